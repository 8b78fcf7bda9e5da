"""Chunks of a study worked by dask: by the workers of a scheduler, or by processes on this computer."""

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
from a7sim.study.executors import RESUME_HINT

WORKER_TIMEOUT_S = 5.0
"""How long a scheduler has to answer, and to have a worker."""

_URL = re.compile(r"(tcp|tls|ws|wss|ucx)://[^/\s]+:\d+/?")
_RETRIES = 3


@contextmanager
def open_dask_executor(scheduler: str | None, workers: int) -> Iterator[tuple[Executor, int]]:
    """Yield an executor of dask and how many chunks its workers work at once; a lost worker's are worked by another.

    Without the URL of a scheduler, so many processes of this computer work, which end with this one.
    Raises Mistake without dask, for a scheduler that does not answer, has no workers or those of another a7sim, and in
    the body once the scheduler, or worker after worker, is lost.
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
    """Let the process that asked decide what an interrupt ends; dask calls this in the workers of this computer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _checked(scheduler: str) -> str:
    if not _URL.fullmatch(scheduler):
        raise A7SimError(f"--scheduler: expected a URL such as tcp://127.0.0.1:8786, got {scheduler[:200]!r}")
    return scheduler


def _at_once(client: Any, scheduler: str | None) -> int:
    """Return how many chunks a cluster works at once, having seen that all its workers have the a7sim that asks."""
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
    """Keep what dask logs about lost connections from the terminal: what matters is said in a sentence."""
    for name in list(logging.root.manager.loggerDict):
        if name.split(".")[0] in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
