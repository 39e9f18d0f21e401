"""Registers and stack of every kernel on a GPU, of the binaries that `cuda.py --out DIR` leaves.

    python tests/kernels/cuda.py --out DIR
    python tests/kernels/registers.py DIR [--names WORD]

Registers bound how many threads a multiprocessor holds. A stack is what a thread keeps in memory: arrays that are indexed by
a variable, and registers that were spilled; `loads` and `stores` count the instructions that go there, in loops once.

Needs `cuobjdump` and `nvdisasm`, on the path or from PyPI: pip install nvidia-cuda-cuobjdump nvidia-cuda-nvdisasm
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path

PACKAGES = {"cuobjdump": "nvidia-cuda-cuobjdump", "nvdisasm": "nvidia-cuda-nvdisasm"}


def tool(name: str) -> str:
    """Path of a tool of CUDA. Ends the program where there is none."""
    installed = sorted(Path(sysconfig.get_path("purelib")).glob(f"nvidia/*/bin/{name}*"))
    found = shutil.which(name) or (str(installed[-1]) if installed else None)
    if found is None:
        sys.exit(f"there is no {name}: pip install {PACKAGES[name]}")
    return found


@dataclass(frozen=True)
class Use:
    """What a thread of a kernel takes: registers, stack [bytes], and instructions that load and store what is there."""

    kernel: str
    module: str
    registers: int
    stack: int
    loads: int
    stores: int
    scenes: tuple[str, ...]


def disassembled(binary: Path) -> dict[str, str]:
    """The instructions of every kernel of a binary."""
    listing = subprocess.run([tool("nvdisasm"), "-c", binary], capture_output=True, text=True, check=True).stdout
    parts = listing.split(".section\t.text.")[1:]
    return {part.partition("\n")[0].split(",")[0].strip(): part for part in parts}


def uses(module: str, binary: Path, scenes: list[str]) -> list[Use]:
    """The kernels of one module."""
    usage = subprocess.run([tool("cuobjdump"), "-res-usage", binary], capture_output=True, text=True, check=True).stdout
    rows = re.findall(r"Function (\w+):\s+REG:(\d+) STACK:(\d+)", usage)
    code = disassembled(binary) if any(int(stack) for _, _, stack in rows) else {}
    found = []
    for name, registers, stack in rows:
        loads, stores = (len(re.findall(rf"\b{word}\b", code.get(name, ""))) for word in ("LDL", "STL"))
        kernel = re.sub(r"_[0-9a-f]{8}_cuda_kernel_forward$", "", name).rsplit("__", 1)[-1]
        found.append(Use(kernel, module, int(registers), int(stack), loads, stores, tuple(scenes)))
    return found


def main() -> int:
    """Print the table, the most registers first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="what cuda.py was given as --out")
    parser.add_argument("--names", default="", help="only kernels whose name has this in it")
    chosen = parser.parse_args()
    modules = json.loads((chosen.folder / "modules.json").read_text())
    found = (uses(name, chosen.folder / facts["binary"], facts["scenes"]) for name, facts in modules.items())
    rows = [use for of_module in found for use in of_module if chosen.names in use.kernel]
    rows.sort(key=lambda use: (-use.registers, -use.stack, use.kernel, use.module))
    print(f"{'kernel':<20} {'registers':>9} {'stack':>6} {'loads':>6} {'stores':>6}  scenes")
    for use in rows:
        more = f" and {len(use.scenes) - 1} more" if len(use.scenes) > 1 else ""
        print(
            f"{use.kernel:<20} {use.registers:>9} {use.stack:>6} {use.loads:>6} {use.stores:>6}  {use.scenes[0]}{more}"
        )
    stacked = sum(use.stack > 0 for use in rows)
    print(f"{len(rows)} kernels of {len(modules)} modules; {stacked} have a stack")
    return 0


if __name__ == "__main__":
    sys.exit(main())
