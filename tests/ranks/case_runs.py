"""Runs of scenes by one process and by several that share them: what each comes to, in digests of all that a run gives."""

import hashlib
import json
import os
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

import wsph
from wsph.backend import graph
from wsph.backend.domain import WHOLE
from wsph.contact.meeting.ways import Places, Way
from wsph.formulations.updated.sharing.near import Near, Sights
from wsph.scene import geometries


def digest(result: wsph.Result) -> str:
    """Of everything that a run gives."""
    found = hashlib.sha256()
    arrays = {**result.particles, **{f"h.{k}": v for k, v in result.history.items()}}
    arrays |= {f"p.{name}.{k}": v for name, probe in result.probes.items() for k, v in probe.items()}
    if result.cells is not None:
        arrays |= {f"c.{k}": v for k, v in (result.cells.blocks | result.cells.data).items()}
    for name in sorted(arrays):
        found.update(name.encode() + np.ascontiguousarray(arrays[name]).tobytes())
    keys = ("status", "steps", "particles", "pairs", "energy", "dt", "findings", "fracture", "relaxation")
    said = {key: result.summary.get(key) for key in keys}
    found.update(json.dumps(said, sort_keys=True).encode())
    return found.hexdigest()[:16]


@contextmanager
def holding_little() -> Generator[None]:
    """Bodies whose pairs follow the motion have so little around them that it does not last long."""
    reach_of = geometries.reach_of
    geometries.reach_of = lambda *given: replace(reach_of(*given), beyond=2)
    yield
    geometries.reach_of = reach_of


class Searches:
    """How often pairs that follow the motion have been found."""

    def __init__(self) -> None:
        self.count, find = 0, Near.find

        def counted(near: Near, look: Callable[[np.ndarray | None], Sights], place: np.ndarray, reach: float) -> Sights:
            self.count += 1
            return find(near, look, place, reach)

        Near.find = counted  # type: ignore[method-assign]


class Visited:
    """Pairs of a vertex and a face that a process has looked at in contacts of surfaces, of all searches."""

    def __init__(self) -> None:
        self.count, find = 0, Way.find

        def counted(way: Way, places: Places, skin: float) -> None:
            find(way, places, skin)
            self.count += len(way.rows.struct.indices)

        Way.find = counted  # type: ignore[method-assign]

    def of(self, comm: object, run: Callable[[], str | None]) -> tuple[str | None, list[int]]:
        """What a run gives, and the pairs that each process has looked at in it."""
        before = self.count
        found = run()
        return found, comm.allgather(self.count - before)  # type: ignore[attr-defined]


def shared(comm: object, made: wsph.Scene, count: int, **options: object) -> str | None:
    """The digest of a scene that the first `count` processes share; None in the others."""
    from wsph.ranks.mpi import Ranks

    part = comm.Split(0 if comm.rank < count else 1, comm.rank)  # type: ignore[attr-defined]
    found = None
    if comm.rank < count:  # type: ignore[attr-defined]
        result = wsph.run(made, domain=Ranks(part) if count > 1 else WHOLE, **options)  # type: ignore[arg-type]
        found = digest(result)
    part.Free()
    comm.Barrier()  # type: ignore[attr-defined]
    return found


def resumed(comm: object, made: wsph.Scene) -> dict[str, str | None]:
    """The same where a run has been stopped half way by two processes, and others have gone on."""
    folder = Path(comm.bcast(tempfile.mkdtemp() if comm.rank == 0 else None))  # type: ignore[attr-defined]
    half = made.with_(end=made.end / 2, checkpoint={"every": 4, "final": True})
    shared(comm, half, 2, out=folder / "2")
    found = _gone_on(comm, made, folder)
    shared(comm, half, 1, out=folder / "1 to 3")
    found["1 to 3"] = shared(comm, made, 3, out=folder / "1 to 3", resume=True)
    comm.Barrier()  # type: ignore[attr-defined]
    if comm.rank == 0:  # type: ignore[attr-defined]
        shutil.rmtree(folder)
    return found


def begun(comm: object, made: wsph.Scene) -> dict[str, str | None]:
    """The same of runs that begin with the state that two processes have kept."""
    folder = Path(comm.bcast(tempfile.mkdtemp() if comm.rank == 0 else None))  # type: ignore[attr-defined]
    shared(comm, made.with_(checkpoint={"final": True}), 2, out=folder / "2")
    (file,) = (folder / "2" / "checkpoints").glob("checkpoint_????????????.npz")
    again = made.with_(**{"bodies.0.initial": {"file": str(file)}})
    return {str(count): shared(comm, again, count) for count in range(1, comm.size + 1)}  # type: ignore[attr-defined]


def stopped(comm: object, made: wsph.Scene) -> dict[str, str | None]:
    """The same where a relaxation of two processes was asked to end in its middle."""
    folder = Path(comm.bcast(tempfile.mkdtemp() if comm.rank == 0 else None))  # type: ignore[attr-defined]

    def stop(*_: object) -> None:
        if comm.rank == 0:  # type: ignore[attr-defined]
            os.kill(os.getpid(), signal.SIGINT)

    shared(comm, made, 2, out=folder / "2", progress=stop, throw=False)
    return _gone_on(comm, made, folder)


def _gone_on(comm: object, made: wsph.Scene, folder: Path) -> dict[str, str | None]:
    """What four processes, and one, go on to from a folder of two."""
    found: dict[str, str | None] = {}
    for count in (4, 1):
        if comm.rank == 0:  # type: ignore[attr-defined]
            shutil.copytree(folder / "2", folder / f"2 to {count}")
        comm.Barrier()  # type: ignore[attr-defined]
        found[f"2 to {count}"] = shared(comm, made, count, out=folder / f"2 to {count}", resume=True)
    return found


def main(names: list[str], cases: Mapping[str, Callable[[], wsph.Scene]]) -> None:
    from mpi4py import MPI

    warnings.simplefilter("ignore")
    comm, every = MPI.COMM_WORLD, names[:1] == ["--every"]
    for k, name in enumerate(names[every:]):
        made = cases[case_of(name)]()
        # Without all of them, one process, and in turn two, three or four.
        counts = list(range(1, comm.size + 1)) if every else [1, 2 + k % (comm.size - 1)]
        if name.endswith(", threads"):
            graph.SMALL_PAIRS = 0
            found = {"1 thread": shared(comm, made.with_(threads=1), 1)}
            made = made.with_(threads=2)
            found |= {str(count): shared(comm, made, count) for count in counts}
        elif name.endswith(", stopped"):
            made = made.with_(**{"probes": []})
            found = {"1": shared(comm, made, 1), **stopped(comm, made)}
        elif name.endswith(", narrow"):
            with holding_little():
                found = {str(count): shared(comm, made, count) for count in counts}
        elif name.endswith(", begun"):
            found = begun(comm, made)
        elif name.endswith(", resumed"):
            made = made.with_(**{"output.history": 3, "probes": []})
            found = {"1": shared(comm, made, 1), **resumed(comm, made)}
        else:
            searches, visited, every_pair = Searches(), Visited(), set[int]()
            found = dict[str, str | None]()
            for count in counts:
                found[str(count)], pairs = visited.of(comm, partial(shared, comm, made, count))
                every_pair.add(sum(pairs))
                assert max(pairs) <= 0.8 * sum(pairs) or count == 1, f"{name}: contacts are of one process: {pairs}"
            assert len(every_pair) == 1, f"{name}: pairs that are looked at: {every_pair}"
            moved, runs = made.run.formulation == "updated-lagrangian", sum(count > comm.rank for count in counts)
            assert not moved or searches.count >= 3 * runs, f"{name}: pairs were found too seldom"
        if comm.rank == 0:
            print(json.dumps({name: found}), flush=True)


def case_of(name: str) -> str:
    """The case that a word of the command line names, without what else is done with it."""
    of, _, last = name.rpartition(", ")
    return of if last in ("resumed", "begun", "stopped", "threads", "narrow") else name


def begin(cases: Mapping[str, Callable[[], wsph.Scene]], write: Callable[[Path], None] | None = None) -> None:
    """What each of the processes does; the first may `write` files, in a folder that it makes where it stands."""
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
    try:
        folder = Path(comm.bcast(tempfile.mkdtemp() if comm.rank == 0 else None))
        if write is not None and comm.rank == 0:
            write(folder)
        comm.Barrier()
        os.chdir(folder)
        main(sys.argv[1:], cases)
        if comm.rank == 0:
            shutil.rmtree(folder)
    except BaseException:
        traceback.print_exc()
        MPI.COMM_WORLD.Abort(1)
