"""A progress bar of a run, on a terminal or in a notebook."""

# pyright: strict

from collections.abc import Callable
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


class Bar:
    """Within it, a call with the step, the last step and the time [s] moves it on. It goes when the run ends."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
        # In a notebook what is written on standard error is no display.
        self._bar = Progress(*columns, console=Console() if console.is_jupyter else console, transient=True)
        self._task = self._bar.add_task("", total=None)

    def __enter__(self) -> Callable[[int, int, float], None]:
        self._bar.start()
        return self

    def __call__(self, step: int, steps: int, time: float) -> None:
        """Move on."""
        self._bar.update(self._task, completed=step, total=steps, description=f"t = {time:.4g} s")

    @property
    def done(self) -> float:
        """The part that is done."""
        return (self._bar.tasks[0].percentage or 0.0) / 100.0

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()
