"""Two processes, and two threads of one, beside one process: at one scene (strong) and at so much of it a process (weak).

    python tests/benchmarks/processes.py [--cells 32 46 80] [--turns 5] [--seconds 4] [--json docs/processes.json]

Takes turns, each run by `ranks.py`; mpiexec is that of the environment, or of PATH. An efficiency in CPU time is of a
process's own time in its launches, without messages; one in wall time has these, and what waits for them. Prints a line of
JSON a turn, and the medians; walls mean something on quiet cores alone.
"""

import argparse
import json
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

RANKS = Path(__file__).parent / "ranks.py"
Row = dict[str, float]


def run(processes: int, *options: str) -> Row:
    """What `ranks.py` prints of a run."""
    beside = Path(sys.executable).with_name("mpiexec")
    launcher = str(beside) if beside.exists() else shutil.which("mpiexec") or sys.exit("no mpiexec")
    command = [sys.executable, str(RANKS), *options]
    if processes > 1:
        command = [launcher, "-n", str(processes), *command]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}: exit {done.returncode}\n{done.stderr}")
    return json.loads(next(line for line in done.stdout.splitlines() if line.startswith("{")))


def turn(cells: int, seconds: float) -> Row:
    """The efficiencies of two processes, one turn; `threads`: how many times as fast two threads are as one."""
    given = ("--cells", str(cells), "--seconds", f"{seconds:g}")
    one, strong, weak = run(1, *given), run(2, *given), run(2, *given, "--weak")
    threads = run(1, *given, "--threads", "2")
    more = weak["particles"] / one["particles"]
    return {
        "particles": one["particles"],
        "held": strong["held"],
        "ns": 1e3 * one["cpu_us"] / one["particles"],
        "strong_cpu": one["cpu_us"] / (2.0 * strong["cpu_us"]),
        "strong_wall": one["wall_us"] / strong["wall_us"],
        "weak_cpu": more * one["cpu_us"] / (2.0 * weak["cpu_us"]),
        "weak_wall": more * one["wall_us"] / (2.0 * weak["wall_us"]),
        "threads_wall": one["wall_us"] / threads["wall_us"],
    }


def main() -> None:
    """Print the turns and their medians, and write the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, nargs="+", default=[32, 46, 80])
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    turns: dict[int, list[Row]] = {cells: [] for cells in options.cells}
    for _ in range(options.turns):
        for cells, rows in turns.items():
            rows.append(turn(cells, options.seconds))
            print(json.dumps({key: round(value, 3) for key, value in rows[-1].items()}), flush=True)
    medians = [
        {key: round(statistics.median(row[key] for row in rows), 3) for key in rows[0]} for rows in turns.values()
    ]
    text = json.dumps({"turns": options.turns, "sizes": medians}, indent=1) + "\n"
    print(text)
    if options.json:
        options.json.write_text(text)


if __name__ == "__main__":
    main()
