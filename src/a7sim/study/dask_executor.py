"""Chunks of a study on dask: on the workers of a scheduler, or in processes of this computer."""

import logging
import re
import signal
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import a7sim
from a7sim.errors import A7SimError
from a7sim.study.checkpoint import RESUME_HINT

WORKER_TIMEOUT_S = 5.0
"""Time limit in seconds for a scheduler to answer and to have a worker."""

_URL = re.compile(r"(tcp|tls|ws|wss|ucx)://[^/\s]+:\d+/?")
_RETRIES = 3


@contextmanager
def open_dask_executor(scheduler: str | None, workers: int) -> Iterator[tuple[Executor, int]]:
    """Yield a dask executor and the number of chunks that its workers run at once.

    The chunks of a lost worker run again.

    Without the URL of a scheduler, `workers` processes of this computer run the chunks and end with this process.
    Raises A7SimError if dask is missing, if the scheduler does not answer, has no workers or workers with another
    version of a7sim, and in the body if the scheduler or one worker after another is lost.
    """
    try:
        distributed = import_module("distributed")
    except ImportError as missing:
        raise A7SimError(
            f"--executor dask: expected distributed to be installed (pip install 'a7sim[dask]'): {missing}"
        ) from missing
    _say_nothing()
    with ExitStack() as until:
        if scheduler is None:
            address = until.enter_context(
                distributed.LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    dashboard_address=None,
                    silence_logs=logging.CRITICAL,
                    preload=__name__,
                )
            )
        else:
            address = _checked(scheduler)
        try:
            client = until.enter_context(distributed.Client(address, timeout=WORKER_TIMEOUT_S, set_as_default=False))
        except (OSError, ValueError) as error:
            raise A7SimError(f"--scheduler: expected one that answers at {scheduler}, got none in 5 s") from error
        at_once = _at_once(client, scheduler)
        executor = client.get_executor(retries=_RETRIES, pure=False)
        until.callback(executor.shutdown, wait=False)
        try:
            yield executor, at_once
        except (distributed.scheduler.KilledWorker, distributed.CancelledError, CancelledError) as error:
            raise A7SimError(f"dask lost its scheduler, or one worker after the other; {RESUME_HINT}") from error


def dask_setup(worker: object) -> None:
    """Ignore interrupts in a worker: the parent process handles them. dask calls this function in local workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _checked(scheduler: str) -> str:
    if not _URL.fullmatch(scheduler):
        raise A7SimError(f"--scheduler: expected a URL such as tcp://127.0.0.1:8786, got {scheduler[:200]!r}")
    return scheduler


def _at_once(client: Any, scheduler: str | None) -> int:
    """Return the number of chunks that a cluster runs at once.

    Raises A7SimError unless all workers have this version.
    """
    try:
        client.wait_for_workers(1, timeout=WORKER_TIMEOUT_S)
    except TimeoutError as error:
        raise A7SimError(f"--scheduler: expected workers at {scheduler}, got a scheduler without any") from error
    try:
        versions = client.run(version, "a7sim")
    except PackageNotFoundError as error:
        raise A7SimError(
            f"--scheduler: expected a7sim {a7sim.__version__} at its workers, got one without a7sim"
        ) from error
    for worker, found in versions.items():
        if found != a7sim.__version__:
            raise A7SimError(f"--scheduler: expected a7sim {a7sim.__version__} at {worker}, got a7sim {found}")
    return sum(client.nthreads().values())


def _say_nothing() -> None:
    """Silence the log messages of dask about lost connections; errors are raised as one sentence."""
    for name in list(logging.root.manager.loggerDict):
        if name.split(".")[0] in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
