"""What a second core is worth: to two threads of one run, and to two runs side by side that share nothing but the machine.

    python tests/benchmarks/cores.py [--dim 3] [--cells 48] [--form elastic] [--precision f64] [--turns 5]

Takes turns: one run of one thread, two of these at the same time, one run of two threads; each by `rows.py`. The second
says what the machine gives: cores share their memory and their clock. Wall times, on a machine that does nothing else.
"""

import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

ROWS = Path(__file__).parent / "rows.py"


def start(threads: int, options: list[str]) -> subprocess.Popen[str]:
    """A run of `rows.py`."""
    command = [sys.executable, str(ROWS), "--threads", str(threads), *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def wall(run: subprocess.Popen[str]) -> float:
    """Nanoseconds a particle-step, when it is over."""
    said = run.communicate()[0]
    if run.returncode:
        sys.exit(f"{' '.join(map(str, run.args))}: exit {run.returncode}")
    return float(json.loads(said.splitlines()[0])["wall_ns"])


def main() -> None:
    """Print a line of JSON a turn, and the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=5)
    options, others = parser.parse_known_args()
    found: dict[str, list[float]] = {"threads": [], "side by side": []}
    for _ in range(options.turns):
        alone = wall(start(1, others))
        both = [start(1, others), start(1, others)]
        beside = statistics.mean([wall(run) for run in both])
        threads = wall(start(2, others))
        found["threads"].append(alone / threads)
        found["side by side"].append(2.0 * alone / beside)
        print(json.dumps({"one": alone, "two side by side": beside, "two threads": threads}), flush=True)
    print(json.dumps({name: round(statistics.median(values), 3) for name, values in found.items()}))


if __name__ == "__main__":
    main()
