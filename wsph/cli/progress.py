"""How far a run is, on a terminal."""

# pyright: strict

import sys
from collections.abc import Callable


class Progress:
    """A progress bar on a terminal, silence elsewhere."""

    def __init__(self, quiet: bool):
        self._shown = not quiet and sys.stderr.isatty()

    def __enter__(self) -> Callable[[int, int, float], None] | None:
        if not self._shown:
            return None
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bar

        self._bar = Bar(
            TextColumn("{task.description}"),
            BarColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._bar.start()
        self._task = self._bar.add_task("", total=None)

        def update(step: int, steps: int, time: float) -> None:
            self._bar.update(self._task, completed=step, total=steps, description=f"t = {time:.4g} s")

        return update

    def __exit__(self, *_: object) -> None:
        if self._shown:
            self._bar.stop()
