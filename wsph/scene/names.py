"""Names that a scene gives to its tables."""

# pyright: strict


def printable(name: str) -> str:
    """Names of bodies go into messages and files."""
    if not name.isprintable() or name.strip() != name or not name:
        raise ValueError(
            f"{name!r} has characters that cannot be printed, or blanks at its ends: a name has printed characters"
        )
    return name
