"""The device that a scene runs on, and the memory that is left there."""

# pyright: strict

import contextlib
import ctypes
import os
import re
import sys
import tempfile
from pathlib import Path

import warp as wp

from wsph.errors import Refused

LARGE = 100_000
"""Particles whose set-up leaves some megabytes."""


def start_warp() -> None:
    """Start Warp, without its remark on a machine that has no GPU and its line per module; a host program that has started
    Warp itself keeps its own settings."""
    if wp.config.log_level == wp.LOG_INFO:
        wp.config.log_level = wp.LOG_WARNING
    try:
        kept = os.dup(2)
    except OSError:  # standard error is closed: there is nothing to keep clean
        wp.init()
        return
    with tempfile.TemporaryFile() as said:
        os.dup2(said.fileno(), 2)
        try:
            wp.init()
        finally:
            os.dup2(kept, 2)
            os.close(kept)
        said.seek(0)
        for line in said.read().decode(errors="replace").splitlines():
            if "Could not find or load the NVIDIA CUDA driver" not in line:
                print(line, file=sys.stderr)


def pick_device(name: str, place: int = 0) -> str:
    """The Warp device that a scene means; "auto" is a GPU, or else the CPU, "cuda" a GPU: the first one or, of processes
    that share a scene, one each in turn, by their `place` on their machine. Raises Refused where there is none."""
    start_warp()
    known = [str(d) for d in wp.get_devices()]
    if name == "auto" and not wp.is_cuda_available():
        return "cpu"
    of_gpus = [each for each in known if each.startswith("cuda")] or ["cuda:0"]
    chosen = of_gpus[place % len(of_gpus)] if name in ("auto", "cuda") else name
    if chosen not in known:
        auto = '; "auto" takes a GPU where there is one' if name == "cuda" else ""
        raise Refused(f"run.device: there is no {name!r} on this machine; there is {', '.join(known)}{auto}")
    return chosen


def devices() -> dict[str, str]:
    """Every device that a scene can name, and what it is."""
    start_warp()
    found: dict[str, str] = {}
    for device in wp.get_devices():
        name, called = str(device), str(device.name)  # pyright: ignore[reportUnknownMemberType, reportUnknownArgumentType]
        free, _ = free_memory(name)
        memory = f", {free / 1e9:.3g} GB free" if free is not None else ""
        found[name] = f"({called or 'the host'}{memory})"
    return found


def kernel_cache() -> tuple[Path, int, int]:
    """The folder that compiled kernels are kept in, its size [bytes], and the modules in it."""
    start_warp()
    folder = Path(str(wp.config.kernel_cache_dir))
    modules = [each for each in folder.iterdir() if each.is_dir()] if folder.is_dir() else []
    size = sum(file.stat().st_size for module in modules for file in module.rglob("*") if file.is_file())
    return folder, size, len(modules)


def free_memory(device: str) -> tuple[float | None, float | None]:
    """Memory left to this process [bytes], on the device and on the host; None where the system does not say."""
    host = _free_on_host()
    return (host if device == "cpu" else float(wp.get_device(device).free_memory)), host


def give_back(particles: int) -> None:
    """Give the system back what a set-up of so many particles has freed and the C library keeps, where that can (glibc) and
    they are LARGE."""
    if particles < LARGE:
        return
    with contextlib.suppress(OSError, TypeError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def _free_on_host() -> float | None:
    """The least of what the machine has, what the limits of the process leave, and what its control groups leave."""
    found = [*_free_of_machine(), *_free_of_limits(), *_free_of_groups()]
    return max(min(found), 0.0) if found else None


def _text(path: str) -> str:
    """A file of the system, or "" where there is none."""
    try:
        return Path(path).read_text()
    except OSError:
        return ""


def _free_of_machine() -> list[float]:
    """Memory that can be had without swapping."""
    return [1024.0 * float(kb) for kb in re.findall(r"MemAvailable:\s+(\d+) kB", _text("/proc/meminfo"))]


def _free_of_limits() -> list[float]:
    """What `ulimit -v` and `ulimit -d` leave."""
    pages = [float(number) for number in _text("/proc/self/statm").split()]
    if not pages:
        return []
    import resource

    used = {resource.RLIMIT_AS: pages[0], resource.RLIMIT_DATA: pages[5]}
    limits = {which: resource.getrlimit(which)[0] for which in used}
    size = resource.getpagesize()
    return [limits[which] - size * held for which, held in used.items() if limits[which] != resource.RLIM_INFINITY]


def _free_of_groups() -> list[float]:
    """What the control groups of the process leave, of both versions; caches of files can be had back."""
    found: list[float] = []
    for line in _text("/proc/self/cgroup").splitlines():
        controllers, _, path = line.partition(":")[2].partition(":")
        old = controllers == "memory"
        if controllers and not old:
            continue
        top = Path("/sys/fs/cgroup/memory" if old else "/sys/fs/cgroup")
        most, used = ("limit_in_bytes", "usage_in_bytes") if old else ("max", "current")
        group = top / path.lstrip("/")
        # In a container the path is that of the host, and its own group stands at the top.
        for folder in dict.fromkeys([*_below(top, group), top]):
            bound, held = (_text(str(folder / f"memory.{name}")).strip() for name in (most, used))
            if bound.isdigit() and held.isdigit():
                cached = re.search(r"^(?:total_)?inactive_file (\d+)", _text(str(folder / "memory.stat")), re.MULTILINE)
                found.append(float(bound) - float(held) + (float(cached[1]) if cached else 0.0))
    return found


def _below(top: Path, group: Path) -> list[Path]:
    """A control group and those that it is part of, up to the top."""
    return [folder for folder in (group, *group.parents) if folder.is_relative_to(top)]
