"""What a command of the command line is: its name, a line of help, its options, and what it does."""

# pyright: strict

import argparse
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Command:
    """A command: `declare` adds its options to a parser of its own, `act` does it and returns the exit code."""

    name: str
    help: str
    declare: Callable[[argparse.ArgumentParser], None]
    act: Callable[[argparse.Namespace], int]
