"""The device that a scene runs on."""

# pyright: strict

import os
import sys
import tempfile

import warp as wp

from wsph.errors import Refused

_NO_DRIVER = "Could not find or load the NVIDIA CUDA driver"


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
            if _NO_DRIVER not in line:
                print(line, file=sys.stderr)


def pick_device(name: str) -> str:
    """The Warp device that a scene means; "auto" is the first GPU, or else the CPU. Raises Refused where there is none."""
    start_warp()
    if name == "auto":
        return "cuda:0" if wp.is_cuda_available() else "cpu"
    known = [str(d) for d in wp.get_devices()]
    if name not in known:
        raise Refused(f"run.device: there is no {name!r} on this machine; there is {', '.join(known)}")
    return name
