"""The rows of a search that processes share: the first of them searches, and says what all are to run.

A row has the bits of one process, whoever runs it: coarse rows, which are too small to be cut, and what processes cannot
share the first process runs by itself.
"""

# pyright: strict

from collections.abc import Iterable
from pathlib import Path

from wsph.accuracy.planning.watch import Watch
from wsph.accuracy.running.order import Order, Ran, timed
from wsph.backend.domain import Domain
from wsph.backend.reduce import BLOCK
from wsph.errors import Refused, SceneError, WsphError
from wsph.output.interrupts import Interrupts
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import Composition
from wsph.simulation.composing.setting import method_of
from wsph.simulation.composing.shared import refuse_shared, refuse_whole
from wsph.simulation.result import Result
from wsph.simulation.run import Progress, run

LEAST = 4 * BLOCK
"""Particles a process from which a row is cut: with fewer, messages take longer than what they spare."""


class Together:
    """This process, or what the first says to the others, which `follow`."""

    takes_composed = True

    def __init__(self, domain: Domain):
        self._domain, self._alone = domain, domain.size == 1
        self.shared = 0
        """Runs that all processes have shared."""

    def refuse(self, scene: Scene) -> None:
        """Raise SceneError for what of a scene they cannot share."""
        if not self._alone:
            refuse_shared(scene, method_of(scene))

    def ahead(self, orders: Iterable[Order]) -> int:
        """There is one place for them, and what they are to be is not asked."""
        return 0

    def run(self, order: Order, progress: Progress | None, composed: Composition | None) -> Ran:
        """Run a row, which may be `composed` already: with all processes, or alone."""
        watch = Watch(order.due, order.begun, progress)
        return timed(watch, lambda: self._run(order.scene, order.out, watch, composed))

    def _run(self, scene: Scene, out: Path | None, watch: Watch, composed: Composition | None) -> Result:
        progress, enough = watch.progress, watch.late
        if self._alone or not self._fits(scene, composed):
            return run(scene, out, overwrite=True, throw=False, progress=progress, composed=composed, enough=enough)
        domain = self._domain = self._domain.afresh()
        try:
            domain.told(lambda: (scene, out))
            found = run(scene, out, overwrite=True, throw=False, progress=progress, domain=domain, enough=enough)
        except (SceneError, Refused):
            # What processes alone are refused, such as a probe of more than any of them has: all have met it.
            return run(scene, out, overwrite=True, throw=False, progress=progress, enough=enough)
        except BaseException as error:
            domain.fail(error)
            self._alone = True
            raise
        self.shared += 1
        return found

    def _fits(self, scene: Scene, composed: Composition | None) -> bool:
        """Whether processes can share a scene, and it is worth it. One that is too large to be composed for its plan is."""
        method = method_of(scene)
        try:
            refuse_shared(scene, method)
            if composed is not None:
                sizes = [body.system.share.whole for body in composed.bodies]
                size = self._domain.size
                refuse_whole(scene, [each >= LEAST * size for each in sizes], size)
        except (SceneError, Refused):
            return False
        return True

    def end(self) -> None:
        """Let the others go."""
        if not self._alone:
            self._domain.afresh().told(lambda: None)


def follow(domain: Domain) -> None:
    """Run what the first process says, until it lets go. An error of a run it meets itself, and says."""

    def said() -> tuple[Scene, Path | None] | None:
        """Only the first is asked."""

    with Interrupts():  # one that all are sent is for the first, or for a run
        while (order := (now := domain.afresh()).told(said)) is not None:
            scene, out = order
            try:
                run(scene, out, overwrite=True, throw=False, domain=now)
            except (SceneError, Refused):
                continue
            except WsphError:
                return
