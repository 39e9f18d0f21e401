"""The command line: `wsph COMMAND ...`; its commands are in `commands`, one a file."""

# pyright: strict

from wsph.cli.entry import main

__all__ = ["main"]
