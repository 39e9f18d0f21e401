"""Where the rows of a study or of a search are made, and the runs of a fit, beyond the processes of this machine: any
executor of `concurrent.futures`.

A scheduler of Dask gives the task of a worker that is lost to another; a row is lost where that has happened several times.
"""

# pyright: strict
# pyright: reportMissingImports=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

from collections.abc import Callable, Generator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from functools import partial
from typing import ParamSpec, Protocol, TypeVar, cast

from wsph.accuracy.running.task import Lost
from wsph.errors import Refused
from wsph.ranks.world import refuse_strangers

T = TypeVar("T")
P = ParamSpec("P")

MPI = "mpi"
"""The name of the scheduler that `mpiexec -n N python -m mpi4py.futures` starts."""

RETRIES = 3
"""Times that a task which has failed is given to another worker."""


class DaskExecutor(Executor):
    """The workers of a scheduler of Dask."""

    def __init__(self, address: str):
        """Raises Refused where nothing answers at the address."""
        try:
            from distributed import Client
        except ImportError as error:
            raise Refused(f"--scheduler {address}: {error}: install wsph[cluster]") from error
        try:
            self._client = Client(address, timeout="20s", set_as_default=False)
        except (OSError, ValueError) as error:
            raise Refused(f"--scheduler {address}: no scheduler of Dask answers there: {error}") from error

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """As `Executor.submit`; task and result have to be picklable, and wsph installed where they go. Raises Lost."""
        future: Future[T] = Future()
        try:
            task = cast(Task, self._client.submit(partial(fn, *args, **kwargs), pure=False, retries=RETRIES))
        except Exception as error:  # Dask has many names for a scheduler that is gone
            raise Lost(f"the scheduler takes nothing: {type(error).__name__}: {error}") from error
        task.add_done_callback(partial(_passed_on, future))
        future.add_done_callback(partial(_dropped, task))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let go of the scheduler, which drops what is not done; it and its workers stay."""
        self._client.close()


class Task(Protocol):
    """A task of Dask."""

    status: str

    def cancel(self) -> object: ...

    def release(self) -> None: ...

    def result(self) -> object: ...

    def add_done_callback(self, call: "Callable[[Task], object]") -> object: ...

    def exception(self) -> BaseException | None: ...


def _passed_on(future: Future[T], task: Task) -> None:
    """Give what became of a task of Dask to the future that stands for it, unless nobody waits for that any more."""
    if not future.set_running_or_notify_cancel():
        return
    if task.status == "finished":
        try:
            future.set_result(cast(T, task.result()))
        except Exception as error:  # it has to be told, or its caller waits for ever
            future.set_exception(Lost(f"its result did not come: {type(error).__name__}: {error}"))
        task.release()
        return
    error = task.exception() if task.status == "error" else None
    if error is None or type(error).__name__ == "KilledWorker":
        error = Lost(f"its workers were lost ({error or task.status})")
    future.set_exception(error)


def _dropped(task: Task, future: Future[T]) -> None:
    """Have Dask forget a task whose future was cancelled: what runs already sees that (`wsph.accuracy.running.wanted`)."""
    if future.cancelled():
        task.cancel()


@contextmanager
def executor_at(scheduler: str | None) -> Generator[Executor | None]:
    """The executor that a scheduler gives: of Dask at an address such as tcp://host:8786, or of MPI by the name "mpi"; None
    where none is named. Raises Refused for one that there is not."""
    if scheduler is None:
        yield None
    elif scheduler == MPI:
        try:
            from mpi4py import MPI as mpi
            from mpi4py.futures import MPIPoolExecutor
        except (ImportError, RuntimeError) as error:
            raise Refused(f"--scheduler mpi: {error}: install wsph[mpi]") from error
        refuse_strangers(mpi.COMM_WORLD.Get_size())
        with MPIPoolExecutor() as pool:
            if pool.num_workers < 1:
                raise Refused(
                    "--scheduler mpi: there are no workers: mpiexec -n N python -m mpi4py.futures -m wsph COMMAND ..."
                )
            yield pool
    else:
        dask = DaskExecutor(scheduler)
        try:
            yield dask
        finally:
            dask.shutdown()
