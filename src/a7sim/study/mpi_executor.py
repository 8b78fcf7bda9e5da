"""Chunks of a study worked over MPI: the first process asks, the others work."""

from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib import import_module

from a7sim.errors import A7SimError

MPI_COMMAND = "mpiexec -n 5 a7sim study ... --executor mpi"
"""How four workers and the one that asks are started."""


@contextmanager
def open_mpi_executor(environment: Mapping[str, str]) -> Iterator[tuple[Executor, int]]:
    """Yield, in the first process of all that mpiexec started, an executor of the others and how many they are.

    Another process that comes here works until the first one is done, and ends. `environment` is set in the others
    where `python -m mpi4py.futures` started them. A process that is lost takes all down, as MPI has it.
    Raises Mistake without MPI, or in a process that was started alone.
    """
    try:
        MPI, futures = import_module("mpi4py.MPI"), import_module("mpi4py.futures")
    except (ImportError, RuntimeError) as missing:
        why = str(missing).splitlines()[0]
        raise A7SimError(f"--executor mpi: expected MPI and mpi4py (pip install 'a7sim[mpi]'): {why}") from missing
    processes = MPI.COMM_WORLD.Get_size()
    if processes < 2:
        raise A7SimError(f"--executor mpi: expected two processes or more ({MPI_COMMAND}), got this one alone")
    with futures.MPICommExecutor(MPI.COMM_WORLD, root=0, env=dict(environment)) as executor:
        if executor is not None:
            yield executor, processes - 1
    if executor is None:
        raise SystemExit(0)
