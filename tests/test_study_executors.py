"""Every executor gives the same bytes; a lost worker or a wrong executor gives one sentence."""

import multiprocessing
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from types import SimpleNamespace

import pytest

from a7sim.errors import A7SimError
from a7sim.result_documents import as_json
from a7sim.study import mpi_executor
from a7sim.study.checkpoint import checkpoint_path, save
from a7sim.study.executors import open_executor
from a7sim.study.findings import findings_document
from a7sim.study.folder import write_results
from a7sim.study.loading import build_study
from a7sim.study.running import ChunkPolicy, run_study
from a7sim.study.tally import Tally
from tests.support.processes import a7sim_captured
from tests.support.server_thread import TIMEOUT_S
from tests.test_study import BY_COMPARATOR

RUN_BY_MPI = shutil.which("mpiexec", path=os.pathsep.join([os.path.dirname(sys.executable), os.environ["PATH"]]))  # noqa: PTH120
NEEDS_MPI = pytest.mark.skipif(RUN_BY_MPI is None, reason="there is no mpiexec: MPI is not installed")


def laid(tmp_path):
    return build_study(BY_COMPARATOR, tmp_path)


def run_with(study, tally, kind, workers, tick=lambda _: None):
    with open_executor(kind, workers) as (executor, at_once):
        run_study(study, tally, executor, at_once, None, tick, ChunkPolicy(largest_chunk=1))


def written_files(study, tally, folder):
    """Return the document and the files of a study."""
    folder.mkdir()
    document = findings_document(study, tally)
    write_results(folder, study, tally, document)
    save(tally, checkpoint_path(folder), study.identity)
    return {path.name: path.read_bytes() for path in folder.iterdir()} | {"--json": as_json(document)}


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """Return the document and the files of the study run in this process without interruption."""
    folder = tmp_path_factory.mktemp("alone")
    study = laid(folder)
    tally = Tally.empty(2, 2)
    run_with(study, tally, "process", None)
    return written_files(study, tally, folder / "out")


class WorkerKiller:
    """A progress callback that kills a worker at the first result."""

    def __init__(self):
        self.pid = None

    def __call__(self, _):
        if self.pid is None:
            self.pid = max(each.pid for each in multiprocessing.active_children())
            os.kill(self.pid, signal.SIGKILL)


@pytest.mark.slow
def test_a_study_on_dask_gives_the_same_bytes_after_a_worker_is_killed(uninterrupted, tmp_path, capfd):
    study, tally, killing = laid(tmp_path), Tally.empty(2, 2), WorkerKiller()
    run_with(study, tally, "dask", 2, killing)
    assert killing.pid is not None
    assert written_files(study, tally, tmp_path / "out") == uninterrupted
    assert capfd.readouterr() == ("", "")


def test_a_pool_reports_a_lost_worker_and_the_study_resumes_to_the_same_bytes(uninterrupted, tmp_path):
    study, tally = laid(tmp_path), Tally.empty(2, 2)
    with pytest.raises(A7SimError, match="a worker of the study was lost"):
        run_with(study, tally, "pool", 1, WorkerKiller())
    assert 0 < tally.done.sum() < 12
    run_with(study, tally, "process", None)
    assert written_files(study, tally, tmp_path / "out") == uninterrupted


def test_an_interrupted_pool_does_not_wait_for_its_workers():
    with pytest.raises(KeyboardInterrupt), open_executor("pool", 1) as (executor, _):
        worker = executor.submit(os.getpid).result()
        executor.submit(time.sleep, 10 * TIMEOUT_S)
        began = time.monotonic()
        raise KeyboardInterrupt
    assert time.monotonic() - began < TIMEOUT_S
    with pytest.raises(ProcessLookupError):
        os.kill(worker, 0)


@pytest.mark.slow
@NEEDS_MPI
@pytest.mark.parametrize(("n", "started"), [(3, ("-m", "a7sim")), (2, ("-m", "mpi4py.futures", "-m", "a7sim"))])
def test_a_study_over_mpi_prints_the_same_bytes(uninterrupted, tmp_path, n, started):
    path = tmp_path / "study.toml"
    path.write_text(AS_A_FILE)
    command = [RUN_BY_MPI, "-n", str(n), sys.executable, *started, "study", str(path), "--executor", "mpi", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == uninterrupted["--json"]


AS_A_FILE = """
schema_version = 1
title = "Pointings"
question = "Do two pointings help?"
scenario = "a8-strip"
settings = { work = ["comparator"] }
responses = ["strip_plan_at_checks_m", "ways.comparator.accuracy_m.checks.height"]
replicates = 6
seed = 5
[[factor]]
name = "pointings"
path = "comparator.pointings"
levels = [1, 4]
"""


@pytest.fixture
def silent_scheduler():
    """Yield the URL of an endpoint that does not answer."""
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        yield f"tcp://127.0.0.1:{bound.getsockname()[1]}"


WRONG = {
    "no URL": (("--executor", "dask", "--scheduler", "here"), "--scheduler: expected a URL such as tcp://"),
    "a scheduler of a pool": (("--scheduler", "tcp://h:1"), "expected it beside --executor dask"),
    "workers of a scheduler": (("--executor", "dask", "--scheduler", "tcp://h:1", "--workers", "2"), "--workers: exp"),
    "workers of one process": (("--executor", "process", "--workers", "2"), "--workers: expected it for a pool"),
}


@pytest.mark.parametrize("name", list(WRONG))
def test_a_wrong_executor_gives_one_sentence_and_exit_code_2(capsys, name):
    arguments, words = WRONG[name]
    done = a7sim_captured(capsys, "study", "levels", *arguments)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert words in done.stderr


def test_the_error_message_for_a_scheduler_that_does_not_answer_is_one_sentence(monkeypatch, capsys, silent_scheduler):
    monkeypatch.setattr("a7sim.study.dask_executor.WORKER_TIMEOUT_S", 0.5)
    done = a7sim_captured(capsys, "study", "levels", "--executor", "dask", "--scheduler", silent_scheduler)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert f"--scheduler: expected one that answers at {silent_scheduler}" in done.stderr


@pytest.mark.parametrize(
    ("kind", "module", "words"),
    [("dask", "distributed", "pip install 'a7sim[dask]'"), ("mpi", "mpi4py", "pip install 'a7sim[mpi]'")],
)
def test_the_error_message_for_a_missing_library_names_the_extra_to_install(monkeypatch, capsys, kind, module, words):
    monkeypatch.setitem(sys.modules, module, None)
    done = a7sim_captured(capsys, "study", "levels", "--executor", kind)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert words in done.stderr


@NEEDS_MPI
def test_the_error_message_for_a_single_mpi_process_names_the_command():
    code = "from a7sim.cli import main; main()"
    command = [sys.executable, "-c", code, "study", "levels", "--executor", "mpi"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "expected two processes or more (mpiexec -n 5 a7sim study" in done.stderr


def patch_mpi(monkeypatch, processes, executor):
    """Replace mpi4py in one of `processes` processes; `executor` is None in every process but the first."""

    @contextmanager
    def pool(world, root, env):
        assert (world.Get_size(), root, env) == (processes, 0, {"THREADS": "1"})
        yield executor

    world = SimpleNamespace(Get_size=lambda: processes)
    modules = {
        "mpi4py.MPI": SimpleNamespace(COMM_WORLD=world),
        "mpi4py.futures": SimpleNamespace(MPICommExecutor=pool),
    }
    monkeypatch.setattr(mpi_executor, "import_module", modules.__getitem__)


def test_over_mpi_the_first_process_uses_all_other_processes(monkeypatch):
    executor = object()
    patch_mpi(monkeypatch, 5, executor)
    with mpi_executor.open_mpi_executor({"THREADS": "1"}) as asked:
        assert asked == (executor, 4)


def test_over_mpi_another_process_works_and_exits_without_output(monkeypatch):
    """The process must exit: only the first one prints the results of the study."""
    patch_mpi(monkeypatch, 5, None)
    with pytest.raises(SystemExit) as ended, ExitStack() as stack:
        stack.enter_context(mpi_executor.open_mpi_executor({"THREADS": "1"}))
    assert ended.value.code == 0


def test_the_error_message_for_one_process_names_the_command_for_more(monkeypatch):
    patch_mpi(monkeypatch, 1, object())
    with (
        pytest.raises(A7SimError, match=r"two processes or more \(mpiexec -n 5 .*\), got this one alone"),
        ExitStack() as stack,
    ):
        stack.enter_context(mpi_executor.open_mpi_executor({"THREADS": "1"}))
