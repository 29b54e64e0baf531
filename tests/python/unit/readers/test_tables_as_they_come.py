"""Tables with names of two lines, pointers in place of logs, text that MATLAB saved."""

import numpy as np
import pytest

import allanite as al

N = 400
X = np.random.default_rng(0).standard_normal((N, 3))


def test_names_of_two_lines(tmp_path):
    path = tmp_path / "log.csv"
    rows = np.column_stack([np.arange(N) / 50, X])
    head = "Time (s),IMU Gyroscope (deg/s),,\n,X,Y,Z\n"
    path.write_text(head + "\n".join(",".join(f"{v:.6g}" for v in row) for row in rows) + "\n")
    r = al.read(path)
    assert r.columns == tuple(f"IMU Gyroscope {axis}" for axis in "XYZ")
    assert set(r.units) == {"deg/s"}


def test_a_pointer_of_git_lfs_is_named(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 456492\n")
    with pytest.raises(al.InputError, match="pointer of Git LFS"):
        al.read(path)


def test_text_that_matlab_saved(tmp_path):
    path = tmp_path / "log.mat"
    np.savetxt(path, np.column_stack([np.arange(N) / 50, X]), fmt="%16.7e")
    r = al.read(path)
    assert (len(r.columns), r.rate) == (3, pytest.approx(50))


@pytest.mark.parametrize("first", ["", '""'])
def test_a_name_that_is_empty_is_no_group(tmp_path, first):
    path = tmp_path / "log.csv"
    rows = (f"{k},{a:.6g},{b:.6g}" for k, (a, b, _) in enumerate(X))
    path.write_text(f"{first},gx,gy\n" + "\n".join(rows) + "\n")
    assert {"gx", "gy"} <= set(al.read(path, rate=100).columns)
