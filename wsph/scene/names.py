"""Names that a scene gives to its tables."""

# pyright: strict

import re


def printable(name: str) -> str:
    """Names of bodies go into messages and files."""
    if not name.isprintable() or name.strip() != name or not name:
        raise ValueError(
            f"{name!r} has characters that cannot be printed, or blanks at its ends: a name has printed characters"
        )
    return name


def file_name(name: str) -> str:
    """Names of probes are names of files, on every system; those of contacts are columns of one."""
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}", name):
        raise ValueError(
            f"{name!r}: a name has at most 100 of a to z, A to Z, 0 to 9, _ . and -, and begins with none of the last two"
        )
    return name
