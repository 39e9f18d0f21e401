"""How long the README's test command takes, into docs/suite.json: of pytest alone, with kernels in Warp's cache.

    python tests/benchmarks/suite.py             runs all tests but the slow ones, a worker a core; on a quiet machine
    python tests/benchmarks/suite.py LOG         reads the log of such a run (`pytest -v -n auto --dist worksteal`)

A run that is not green is not written down. `python docs/make.py --only suite` puts the figure into the pages.
"""

import argparse
import json
import os
import platform
import re
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def counted(log: str) -> dict[str, int]:
    """What pytest's log says: tests that passed, seconds, workers. Raises SystemExit where it is not that of a green run."""
    closing = re.findall(r"^=* ?(\d+) passed(.*) in ([\d.]+)s", log, re.MULTILINE)
    workers = re.search(r"^(\d+) workers? \[|created: (\d+)/", log, re.MULTILINE)
    if not closing or workers is None or re.search("failed|error", closing[-1][1]):
        raise SystemExit("no log of a green run with pytest-xdist's workers")
    passed, _, seconds = closing[-1]
    return {"passed": int(passed), "seconds": round(float(seconds)), "workers": int(workers[1] or workers[2])}


def main() -> None:
    """Measure, or read, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", nargs="?", type=Path)
    log: Path | None = parser.parse_args().log
    if log is None:
        command = [sys.executable, "-m", "pytest", "-n", "auto", "--dist", "worksteal"]
        text, day = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout, time.time()
    else:
        text, day = log.read_text(encoding="utf-8"), log.stat().st_mtime
    machine = f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, Warp {metadata.version('warp-lang')}"
    found = counted(text) | {"machine": machine, "date": time.strftime("%Y-%m-%d", time.localtime(day))}
    (ROOT / "docs" / "suite.json").write_text(json.dumps(found, indent=1) + "\n")
    print(found)


if __name__ == "__main__":
    main()
