"""Run all benchmarks of this folder, each in its own process."""

import subprocess
import sys
from pathlib import Path

if __name__ == "__main__":
    for bench in sorted(Path(__file__).parent.glob("bench_*.py")):
        print(f"== {bench.name}", flush=True)
        subprocess.run([sys.executable, bench.name], cwd=bench.parent, check=True)
