"""How the loops over pairs are compiled, and how they read their arrays.

Indexing an array takes its stride as it comes at run time and wraps indices below zero. In a loop over pairs this hides from
the compiler that a row's indices and weights lie side by side, so that it gathers them, and adds arithmetic to every gather
of a neighbour: the two loops of a step in 3D took a third longer that way. `element` and `placed` check neither the index
nor the stride: they are for pairs that `wsph.sph.pairs` made, and for arrays that were allocated whole.
"""

import platform
from functools import cache
from pathlib import Path

import warp as wp


@cache
def element(*dtypes: type) -> wp.Function:
    """Warp function (contiguous array of one of `dtypes`, index) -> its element."""
    for dtype in dict.fromkeys(dtypes):

        @wp.func_native("return a.data[k];")
        def element(a: wp.array(dtype=dtype), k: int) -> dtype: ...

    return element  # pyright: ignore[reportPossiblyUnboundVariable]


@cache
def placed(dtype: type) -> wp.Function:
    """Warp function (contiguous array of `dtype`, index, value): sets an element."""

    @wp.func_native("a.data[k] = value;")
    def placed(a: wp.array(dtype=dtype), k: int, value: dtype): ...

    return placed


def vector_width(processor: str) -> int:
    """Bits of the vectors that loops over pairs are compiled for, by what a processor says of itself.

    Gathering neighbours decides. AMD's cores gather number by number: there (Zen 4) double precision is 1.25 to 1.75 times
    as fast in vectors of two, and single precision the same. Intel's are fastest in their widest.
    """
    return 128 if "AuthenticAMD" in processor else 512


def _processor() -> str:
    """The description of this machine's processor by its system."""
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

LANES = {
    "cpu_compiler_flags": " ".join(
        (
            wp.config.cpu_compiler_flags or "-march=native",
            "-fno-signed-zeros -freciprocal-math -ffp-contract=fast -mprefer-vector-width=512 -Wno-pass-failed",
        )
    )
}
"""Options of a module whose loops are over rows that lie side by side: each row is one number of a vector, as wide as this
processor has them, and its sums stay in the order in which they are written."""
