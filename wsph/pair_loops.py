"""How the loops over pairs are compiled for CPUs."""

import platform
from pathlib import Path

import warp as wp


def vector_width(processor: str) -> int:
    """Bits of the vectors that loops over pairs are compiled for, by what a processor says of itself.

    Gathering neighbours decides. AMD's cores gather number by number: there (Zen 4) double precision is 1.25 to 1.75 times
    as fast in vectors of two, and single precision the same. Intel's are fastest in their widest.
    """
    return 128 if "AuthenticAMD" in processor else 512


def _processor() -> str:
    """What this machine says of its processor."""
    try:
        return Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor()


PAIR_LOOPS = {
    "cpu_compiler_flags": " ".join(
        (
            wp.config.cpu_compiler_flags or "",
            "-mreassociate -fno-signed-zeros -ffp-contract=fast",
            f"-mprefer-vector-width={vector_width(_processor())}",
        )
    ).strip()
}
"""Options of a module: sums may be taken in vectors, which is worth 1.2 to 1.8 in time; infinities and NaN stay what they
are. LLVM's vectoriser takes `while` loops whose sums are written s = s + x, and no others."""
