"""Example arguments for every command, and the files that they name."""

import numpy as np

MODEL = "N(N=1)"
LOG = ("log.csv", "--model", "N")
#: Arguments by command; {out} is a folder for new files. Every command has an entry.
RUNS = {
    "inspect": ("log.csv",),
    "adev": ("log.csv",),
    "fit": LOG,
    "check": LOG,
    "improve": LOG,
    "characterize": LOG,
    "report": (*LOG, "-o", "{out}/r.html"),
    "accept": ("log.csv", "--sheet", "sheet.toml"),
    "compare": ("log.csv", MODEL),
    "export": (MODEL, "--rate", "10", "--unit", "rad/s", "--format", "matlab"),
    "predict": ("--aided", "1", "--model", MODEL, "--rate", "10", "--unit", "rad/s"),
    "plan": ("--model", MODEL, "--find", "K(K=1)", "--rate", "10", "--duration", "100"),
    "simulate": (MODEL, "--rate", "10", "-n", "10"),
    "fleet": ("logs", "--out", "{out}/t.csv", "--model", "N"),
    "watch": ("log.csv", "--model", MODEL, "--column", "gyro", "--rate", "10"),
    "demo": ("-o", "{out}/demo"),
    "explore": ("log.csv", "--no-browser"),
    "combine": ("logs/a.csv", "logs/b.csv", "--model", "N"),
    "thermal": ("warm.csv", "--model", "N"),
    "timing": ("phase.csv",),
    "trend": ("phase.csv", "--unit", "s"),
}


def write_logs(folder, samples=300):
    """Write the files named in `RUNS` into a folder."""
    x = np.random.default_rng(1).standard_normal(samples).tolist()
    (folder / "logs").mkdir(exist_ok=True)
    rows = "".join(f"{i / 10},{v!r}\n" for i, v in enumerate(x))
    for path in ("log.csv", "logs/a.csv", "logs/b.csv"):
        (folder / path).write_text("time [s],gyro [rad/s]\n" + rows)
    (folder / "phase.csv").write_text("time [s],phase [s]\n" + rows)
    warm = "".join(f"{i / 10},{v!r},{20 + i / 30}\n" for i, v in enumerate(x))
    (folder / "warm.csv").write_text("time [s],gyro [rad/s],temperature [degC]\n" + warm)
    (folder / "sheet.toml").write_text('[figures]\nangle_random_walk = "1 rad/s/√Hz"\n', "utf-8")
    np.save(folder / "log.npy", np.array(x))
    np.savez(folder / "log.npz", data=np.array(x), rate_hz=10.0, unit="rad/s")
