"""Fuzz one target after another: `run.py --seconds 60 --seed 0 [--target NAME] [--calls N]`.

Each target has a process of its own, which writes down what it tries before it tries it: an input that kills it is
known. What is wanted of every input: an answer or one of allanite's errors, one visible line of 300 letters at most,
within 10 s and 1 GB.
"""

import argparse
import faulthandler
import resource
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path

HERE = Path(__file__).resolve().parent
SLOW, LARGE = 10.0, 1_000_000  # s, KiB


def fuzz(name, seconds, seed, calls, folder):
    """Try damaged inputs until the time or the calls are over; raises at the first that is answered wrongly."""
    sys.path[:0] = [str(HERE), str(HERE.parent)]
    import numpy as np
    from mutate import damaged
    from targets import targets

    from allanite.common.errors import AllaniteError

    warnings.simplefilter("error")
    # Bytes that foreign libraries leave open or warn of are theirs; what a user would see is not.
    warnings.simplefilter("ignore", ResourceWarning)
    warnings.simplefilter("ignore", DeprecationWarning)
    seeds, call, text = targets()[name]()
    rng = np.random.default_rng([seed, *name.encode()])
    tried, end = 0, time.monotonic() + seconds
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    while time.monotonic() < end and tried < calls:
        data = damaged(rng, seeds, text)
        (folder / "input").write_bytes(data)
        start = time.process_time()
        faulthandler.dump_traceback_later(120, exit=True)
        try:
            call(data, folder)
        except AllaniteError as error:
            said = str(error)
            assert said.isprintable(), repr(said)
            assert len(said) <= 300, said
        finally:
            faulthandler.cancel_dump_traceback_later()
        spent = time.process_time() - start
        assert spent < SLOW, f"{spent:.1f} s"
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        assert grown < LARGE, f"{grown / 1e6:.2f} GB"
        tried += 1
    return tried


def child(options):
    faulthandler.enable()
    folder = Path(options.folder)
    try:
        print(fuzz(options.target, options.seconds, options.seed, options.calls, folder))
    except Exception:
        traceback.print_exc()
        sys.exit(1)


def run(target, seconds, seed, calls=10**9, keep=None):
    """Number of inputs tried; None, with the input kept, where one was answered wrongly."""
    with tempfile.TemporaryDirectory(prefix="allanite-fuzz-") as folder:
        command = [
            sys.executable, __file__, "--target", target, "--seconds", str(seconds), "--seed", str(seed),
            "--calls", str(calls), "--folder", folder,
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            # Foreign libraries print what they find; the count is the last word.
            return int(done.stdout.split()[-1]), ""
        keep = Path(keep or ".") / f"fuzz-{target.replace(' ', '-').replace(',', '')}-{seed}.bin"
        keep.write_bytes((Path(folder) / "input").read_bytes())
    return (
        None,
        f"{target}: exit code {done.returncode}, input kept as {keep}\n{done.stderr[-3000:]}",
    )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=50.0, help="of each target")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--calls", type=int, default=10**9)
    parser.add_argument("--target")
    parser.add_argument("--folder")
    options = parser.parse_args()
    if options.folder:
        child(options)
        return
    sys.path[:0] = [str(HERE), str(HERE.parent)]
    from targets import targets

    wrong = 0
    for name in [options.target] if options.target else targets():
        tried, said = run(name, options.seconds, options.seed, options.calls)
        print(f"{name:18} {said if tried is None else f'{tried} inputs'}", flush=True)
        wrong += tried is None
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
