"""Compile every kernel of the examples for CUDA on a machine without a GPU: NVRTC, the compiler, is a part of Warp.

    python tests/kernels/cuda.py [--arch 90] [--out DIR] [--parts]

The examples in both precisions, and with `--parts` the small scenes of `parts.py`, are set up on the CPU. A kernel that does
not compile is named with what the compiler says of it, and the exit code is 1. With `--out` the binaries stay, each in a
folder of its own, and `modules.json`, which says what they hold and which scenes use them: `registers.py` reads them.
"""

import argparse
import contextlib
import json
import multiprocessing
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import warp as wp

sys.path.insert(0, str(Path(__file__).parent))
from scenes import example_scenes, kernels_of, part_scenes

from wsph.formulations.lattice import block_rates

PROCESSES = 2
LEFT_OUT = {
    "meet": "threads of the CPU wait for each other in it, by the CPU compiler's atomics; a GPU never launches it"
}
"""Kernels that are for the CPU alone, and why."""


@contextlib.contextmanager
def _said(file: Path) -> Iterator[None]:
    """What is written to standard error, by compilers too, goes to a file."""
    kept = os.dup(2)
    try:
        with file.open("w") as into:
            os.dup2(into.fileno(), 2)
            yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def _begin(cache: str) -> None:
    block_rates.WIDTH.update(dict.fromkeys(block_rates.WIDTH, 1))  # a row a thread, as a GPU has them
    wp.config.kernel_cache_dir = cache
    wp.config.log_level = wp.LOG_WARNING
    wp.init()


def compiled(module: wp.Module, arch: int, out: Path) -> str:
    """Compile a module into its folder in `out`; what the compiler says where it fails."""
    folder = out / module.get_module_identifier()
    said = out / f"{folder.name}.{os.getpid()}.txt"
    with _said(said):
        try:
            wp.compile_aot_module(module, arch=arch, module_dir=folder, use_ptx=False)
            error = ""
        except Exception as raised:  # whatever of Warp's code generation or the compiler fails
            error = f"{type(raised).__name__}: {raised}"
    error += f"\n{said.read_text().strip()}" if error else ""
    said.unlink()
    return error


def _compile(task: tuple[str, int, Path]) -> tuple[str, dict[str, Any]]:
    """The modules of a scene by their names with hashes: their kernels, and what failed."""
    name, arch, out = task
    kernels = kernels_of(dict([*example_scenes(), *part_scenes()])[name]())
    modules = dict.fromkeys(kernel.module for kernel in kernels if kernel.func.__name__ not in LEFT_OUT)
    found = {
        module.get_module_identifier(): {
            "kernels": sorted(module.kernels),
            # What the other process has compiled already is there, and is not compiled again.
            "error": compiled(module, arch, out),
        }
        for module in modules
    }
    return name, found | {kernel.func.__name__: {} for kernel in kernels if kernel.func.__name__ in LEFT_OUT}


def compile_all(names: list[str], arch: int, out: Path) -> dict[str, dict[str, Any]]:
    """The modules of those scenes: their kernels, the scenes that use them, and what failed; empty for what is left out."""
    modules: dict[str, dict[str, Any]] = {}
    with (
        tempfile.TemporaryDirectory() as cache,
        multiprocessing.get_context("spawn").Pool(PROCESSES, _begin, (cache,)) as pool,
    ):
        for scene, found in pool.imap(_compile, [(name, arch, out) for name in names]):
            for name, module in found.items():
                modules.setdefault(name, module | {"scenes": []})["scenes"].append(scene)
            print(f"{scene}: {len(found)} modules, {len(modules)} in all", flush=True)
    return modules


def main() -> int:
    """Compile the modules and say which fail."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arch", type=int, default=90, help="compute capability, without its point")
    parser.add_argument("--out", type=Path, help="where the binaries stay")
    parser.add_argument("--parts", action="store_true", help="the small scenes of parts too")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        out = (chosen.out or Path(temporary)).resolve()
        out.mkdir(parents=True, exist_ok=True)
        names = [name for name, _ in (*example_scenes(), *(part_scenes() if chosen.parts else ()))]
        modules = compile_all(names, chosen.arch, out)
        left_out = {name: modules.pop(name) for name in list(modules) if name in LEFT_OUT}
        made = {name: module for name, module in modules.items() if not module["error"]}
        for name, module in made.items():
            (module["binary"],) = (
                str(path.relative_to(out)) for path in (out / name).glob(f"*.sm{chosen.arch}*.cubin")
            )
        (out / "modules.json").write_text(json.dumps(made, indent=1) + "\n")
    failed = {name: module["error"] for name, module in modules.items() if module["error"]}
    for name, error in failed.items():
        print(f"\nfails: {name}, of {', '.join(modules[name]['scenes'])}\n{error}")
    for name in left_out:
        print(f"left out: {name}: {LEFT_OUT[name]}")
    print(f"{len(made)} of {len(modules)} modules compile for sm_{chosen.arch}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
