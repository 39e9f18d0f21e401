"""What makes an answer worth less, in words: warned of as it is met, and kept for the findings of the run."""

# pyright: strict

import warnings
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

_KEPT: ContextVar[list[str] | None] = ContextVar("kept", default=None)


@contextmanager
def keeping(said: list[str]) -> Generator[list[str]]:
    """Append to `said` what is warned of inside, each text once, whatever filters do with the warnings."""
    token = _KEPT.set(said)
    try:
        yield said
    finally:
        _KEPT.reset(token)


def doubt(text: str, stacklevel: int = 1) -> None:
    """Warn of something that makes an answer worth less (RuntimeWarning), at the caller or a `stacklevel` above."""
    said = _KEPT.get()
    if said is not None and text not in said:
        said.append(text)
    warnings.warn(text, RuntimeWarning, stacklevel=stacklevel + 1)
