"""Fuzz one target after another: `run.py --seconds 60 --seed 0 [--target NAME] [--calls N]`.

Each target has its own process, which writes down each input before it tries it, so that an input that kills it is
known. Every input must give an answer or one of allanite's errors in one visible line of at most 300 characters, within
10 s and 1 GB.
"""

import argparse
import faulthandler
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from contextlib import suppress
from importlib import import_module
from pathlib import Path

HERE = Path(__file__).resolve().parent
SLOW, LARGE = 10.0, 1_000_000  # s, KiB


def fuzz(name, seconds, seed, calls, folder):
    """Try damaged inputs until the time or the calls are used up; raise at the first wrong answer."""
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
    tried = refused = longest = 0
    slowest, end = 0.0, time.monotonic() + seconds
    before = largest()
    while time.monotonic() < end and tried < calls:
        data = damaged(rng, seeds, text)
        (folder / "input").write_bytes(data)
        start = spent()
        faulthandler.dump_traceback_later(120, exit=True)
        try:
            call(data, folder)
        except AllaniteError as error:
            said = str(error)
            assert said.isprintable(), repr(said)
            assert len(said) <= 300, said
            refused += 1
            longest = max(longest, len(said))
        finally:
            faulthandler.cancel_dump_traceback_later()
        took = spent() - start
        assert took < SLOW, f"{took:.1f} s"
        grown = largest() - before
        assert grown < LARGE, f"{grown / 1e6:.2f} GB"
        tried += 1
        slowest = max(slowest, took)
    return {
        "inputs": tried, "refused": refused, "slowest": round(slowest, 2), "grown": round(grown / 1e3),
        "longest": longest,
    }  # fmt: skip


def spent():
    """Processor time in s of this process and of the processes that it has started."""
    return time.process_time() + forks.cpu


def largest():
    """Memory in KiB of this process, or of the largest process that it has started."""
    return max(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, forks.peak)


class Forks:
    """Isolated readers in a fork of this process that reads many files, because a start costs more than most files.

    The file after the last one of a fork gets its own child process, as every log of a user does.
    """

    def __init__(self, files):
        self.most, self.cpu, self.peak, self.process = files, 0.0, 0, None
        self.files, self.children, self.of_users = 0, 0, None

    def run_child(self, order, results, watch):
        """Take the place of `allanite.common.isolation.run_child`."""
        if self.process is None and self.files == self.most:
            return self._as_of_users(order, results, watch)
        if self.process is None:
            self._start(order)
        try:
            socket.send_fds(self.socket, [json.dumps(order).encode()], [results.fileno()])
            said = self.socket.recv(1 << 10)
        except OSError:
            said = b""
        if said:
            self._count(*json.loads(said))
            self.files += 1
            if self.files == self.most:
                self._end()
            return 0
        return self._end()

    def _as_of_users(self, order, results, watch):
        """Run the order in a new process."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.files = 0
        self.children += 1
        try:
            return self.of_users(order, results, watch)
        finally:
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            self.cpu += after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            self.peak = max(self.peak, after.ru_maxrss)

    def _start(self, order):
        # Once here, not in each fork.
        for module in (*order["libraries"], order["arguments"]["reader"].partition(":")[0]):
            with suppress(ModuleNotFoundError):
                import_module(module)
        if "rosbags.typesys" in order["libraries"]:
            from rosbags.typesys import Stores, get_typestore

            get_typestore(Stores.LATEST)
        self.socket, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.files, self.counted = 0, 0.0
        self.process = os.fork()
        if not self.process:
            self.socket.close()
            # What the library prints as it dies is for nobody.
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            faulthandler.disable()
            with suppress(BaseException):
                _serve(other)
            os._exit(1)
        other.close()

    def _end(self):
        """Wait for the fork and return its exit code."""
        self.socket.close()
        _, status, usage = os.wait4(self.process, 0)
        self.process = None
        self._count(usage.ru_utime + usage.ru_stime, usage.ru_maxrss)
        return os.waitstatus_to_exitcode(status)

    def _count(self, cpu, peak):
        self.cpu += cpu - self.counted
        self.counted, self.peak = cpu, max(self.peak, peak)


def _serve(orders):
    """Serve orders in the fork, each within limits of its own."""
    from allanite.common import isolation

    limited = (resource.RLIMIT_AS, resource.RLIMIT_CPU, resource.RLIMIT_FSIZE)
    before = {which: resource.getrlimit(which) for which in limited}
    while True:
        order, files, _, _ = socket.recv_fds(orders, 1 << 16, 1)
        if not order:
            return
        with os.fdopen(files[0], "r+b") as results:
            isolation.serve_order(json.loads(order), results)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for which, limits in before.items():
            resource.setrlimit(which, limits)
        used = resource.getrusage(resource.RUSAGE_SELF)
        orders.send(json.dumps([used.ru_utime + used.ru_stime, used.ru_maxrss]).encode())


#: What libraries keep of a hundred files does not pass for the memory of the next one.
forks = Forks(files=100)


def fork_children(files=100):
    """Run isolated readers in forks (see `Forks`), each for some files: ten times as many in the same time."""
    from allanite.common import isolation

    forks.most, forks.of_users = files, isolation.run_child
    isolation.run_child = forks.run_child


def child(options):
    faulthandler.enable()
    folder = Path(options.folder)
    try:
        if options.fork:
            fork_children()
        found = fuzz(options.target, options.seconds, options.seed, options.calls, folder)
        print("\n" + json.dumps(found))
    except Exception:
        traceback.print_exc()
        sys.exit(1)


def run(target, seconds, seed, calls=10**9, fork=False):
    """Result of fuzzing one target; None, with the input kept, after a wrong answer."""
    with tempfile.TemporaryDirectory(prefix="allanite-fuzz-") as folder:
        command = [
            sys.executable, __file__, "--target", target, "--seconds", str(seconds), "--seed", str(seed),
            "--calls", str(calls), "--folder", folder, *["--fork"] * fork,
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            # Foreign libraries print what they find; the last line is ours.
            return json.loads(done.stdout.splitlines()[-1]), ""
        keep = Path() / f"fuzz-{target.replace(' ', '-').replace(',', '')}-{seed}.bin"
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
    parser.add_argument("--fork", action="store_true", help="run isolated readers in forks")
    parser.add_argument("--folder")
    options = parser.parse_args()
    if options.folder:
        child(options)
        return
    sys.path[:0] = [str(HERE), str(HERE.parent)]
    from targets import targets

    wrong = 0
    for name in [options.target] if options.target else targets():
        found, said = run(name, options.seconds, options.seed, options.calls, options.fork)
        if found is not None:
            said = (
                "{inputs:6} inputs, {refused:6} refused, slowest {slowest:5.2f} s, {grown:4} MB grown,"
                " longest line {longest}"
            ).format_map(found)
        print(f"{name:18} {said}", flush=True)
        wrong += found is None
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
