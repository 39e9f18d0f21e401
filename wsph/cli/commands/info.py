"""`wsph info`: versions, device, cores and caches, to see what runs here and to report with a question."""

# pyright: strict

import argparse
import json
import os
import platform
from importlib import metadata
from pathlib import Path

from wsph.cli.command import Command

PACKAGES = ("wsph", "warp-lang", "numpy", "pydantic", "meshio", "rich", "h5py", "pyvista", "matplotlib", "imageio")


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON")


def _act(options: argparse.Namespace) -> int:
    found = _found()
    if options.json:
        print(json.dumps(found, indent=2))
        return 0
    for key, value in found.items():
        print(f"{key:<14} {value if isinstance(value, str) else _joined(value)}")
    return 0


def _joined(table: dict[str, str]) -> str:
    return "; ".join(f"{name} {said}".strip() for name, said in table.items())


def _found() -> dict[str, str | dict[str, str]]:
    from wsph.backend.device import devices, kernel_cache
    from wsph.plugins import registry

    cache, size, count = kernel_cache()
    own = {point.name: point for group in registry.GROUPS for point in registry.entries(group)}
    others = {f"{e.distribution} {e.version}": "" for e in own.values() if e.distribution != "wsph"}
    return {
        "python": f"{platform.python_version()}, {platform.platform()}",
        "packages": {name: version for name in PACKAGES if (version := _version(name))},
        "plugins": others or "none but wsph's own",
        "cores": f"{len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count()} of {os.cpu_count()}",
        "devices": devices(),
        "kernel cache": f"{cache}: {count} modules, {size / 1e6:.1f} MB",
        "installed in": str(Path(__file__).resolve().parents[2]),
    }


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


INFO = Command("info", "print versions, devices, cores and caches", _declare, _act)
