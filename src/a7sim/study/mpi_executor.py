"""Chunks of a study over MPI: the first process distributes, the others run."""

from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib import import_module

from a7sim.errors import A7SimError

MPI_COMMAND = "mpiexec -n 5 a7sim study ... --executor mpi"
"""Command that starts one distributing process and four workers."""


@contextmanager
def open_mpi_executor(environment: Mapping[str, str]) -> Iterator[tuple[Executor, int]]:
    """In the first process, yield an executor of the other processes and their number.

    Any other process runs chunks until the first process is done, and then exits. `environment` is set in the other
    processes if `python -m mpi4py.futures` started them. A lost process ends all, as MPI prescribes. Raises A7SimError
    without MPI, or if only one process was started.
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
