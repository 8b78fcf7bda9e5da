"""Executors of the chunks of a study behind one interface: this process, a pool, dask or MPI."""

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any, Literal, ParamSpec, TypeVar, get_args

from a7sim.errors import A7SimError
from a7sim.study.checkpoint import RESUME_HINT

Kind = Literal["process", "pool", "dask", "mpi"]
KINDS: tuple[Kind, ...] = get_args(Kind)

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

P = ParamSpec("P")
T = TypeVar("T")


class InProcess(Executor):
    """Executor that runs each submitted call at once."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Return a finished future. An interrupt propagates."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def open_executor(
    kind: Kind, workers: int | None = None, scheduler: str | None = None
) -> Iterator[tuple[Executor, int]]:
    """Yield an executor and the number of chunks it runs at once; chunks not started are dropped at the end.

    `workers` is the size of the pool, or of dask's local cluster if no `scheduler` is given. Raises A7SimError if a
    library is missing or a scheduler does not answer, and in the body if a worker is lost.
    """
    if scheduler is not None and kind != "dask":
        raise A7SimError(f"--scheduler: expected it beside --executor dask, got --executor {kind}")
    if workers is not None and (scheduler is not None or kind in ("process", "mpi")):
        asked = f"--executor {kind}" if scheduler is None else "--scheduler, which has workers of its own"
        raise A7SimError(f"--workers: expected it for a pool or for dask on this computer, got {asked}")
    workers = workers or os.cpu_count() or 1
    if kind == "process":
        yield InProcess(), 1
    elif kind == "pool":
        with _pool(workers) as pool:
            yield pool, workers
    elif kind == "dask":
        from a7sim.study.dask_executor import open_dask_executor  # noqa: PLC0415

        with open_dask_executor(scheduler, workers) as working:
            yield working
    else:
        from a7sim.study.mpi_executor import open_mpi_executor  # noqa: PLC0415

        with open_mpi_executor(dict.fromkeys(_ONE_THREAD, "1")) as working:
            yield working


@contextmanager
def _pool(workers: int) -> Iterator[Executor]:
    context = get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    with theirs, ours, _environment(dict.fromkeys(_ONE_THREAD, "1")):
        pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_as_a_worker, initargs=(theirs,))
        try:
            yield pool
        except BaseException as error:
            ours.close()
            if isinstance(error, BrokenExecutor):
                raise A7SimError(f"a worker of the study was lost (killed, or out of memory); {RESUME_HINT}") from error
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _as_a_worker(asker: "Connection[Any, Any]") -> None:
    """Ignore interrupts, which the parent process handles, and end when the parent closes the connection or ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with, args=(asker,), daemon=True).start()


def _end_with(asker: "Connection[Any, Any]") -> None:
    asker.poll(None)
    os._exit(1)


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set environment variables for processes started in the body; numpy reads them when it is imported."""
    before: dict[str, Any] = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
