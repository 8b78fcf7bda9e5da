"""Python API: connect to an instrument, run the virtual operator, run a study."""

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Self

from a7sim.deprecation import RenamedMember
from a7sim.errors import A7SimError
from a7sim.instrument import Autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.client.checked_port import TwinCheckedPort, open_checked_port
from a7sim.link.client.client import Client
from a7sim.link.client.ports import TIMEOUT_S
from a7sim.link.inprocess import InProcessSerial
from a7sim.result_documents import Document
from a7sim.scenario import Scenario
from a7sim.session import ProgressCallbacks, RunOptions
from a7sim.session.all_methods import run_all_methods
from a7sim.study.checkpoint import checkpoint_path
from a7sim.study.executors import open_executor
from a7sim.study.findings import findings_document
from a7sim.study.folder import open_tally, write_results
from a7sim.study.loading import LoadedStudy, load_study
from a7sim.study.running import run_study

Name = str | PathLike[str]
"""A file, or the name of one that comes with a7sim."""


def connect(
    to: Name | Scenario, seed: int | None = None, timeout: float = TIMEOUT_S, token: str | None = None
) -> Client:
    """Return a client of a served instrument, given by URL or device, or of a new one in this process, given by
    scenario.

    A new instrument has the photographs and the faults drawn by `seed`, by default the scenario's own. `timeout` is the
    wait for a reply in s; `token` is the login of a server that requires one. Raises A7SimError if no instrument
    answers.

    >>> from a7sim import connect
    >>> with connect("akwanga", seed=7) as client:
    ...     client.send('PHOT1:LOAD "101";:PHOT2:LOAD "102";:BASE:BX 194.99;:DRIV:Z -325.71')
    ...     client.numbers("COUN?")
    [0.0, 0.0, -325.71]
    """
    if isinstance(to, str) and ("://" in to or Path(to).is_char_device()):
        if seed is not None:
            raise A7SimError(f"connect: expected no seed beside {to}, since that instrument has its own")
        return Client.open(to, timeout, token)
    if token is not None:
        raise A7SimError(
            "connect: expected no token beside a scenario, since an instrument in this process asks for none"
        )
    instrument = SharedInstrument(Autograph.from_scenario(*_resolve(to, seed)))
    return Client(InProcessSerial(instrument=instrument, timeout=timeout))


class Operator:
    """Virtual operator for the job of a scenario, with no information but views and readings.

    `scenario` is a loaded scenario, a file, or the name of one that comes with a7sim; `seed` draws film, instrument and
    operator.

    >>> from a7sim import Operator
    >>> results = Operator("dewitt-pair", seed=7).run()
    >>> results["status"], [model["model"] for model in results["models"]]
    ('complete', ['1'])
    """

    def __init__(self, scenario: Name | Scenario, seed: int | None = None) -> None:
        self.scenario, self.seed = _resolve(scenario, seed)

    def run(
        self,
        link: str | None = None,
        out: Name | None = None,
        *,
        force: bool = False,
        timeout: float = TIMEOUT_S,
        token: str | None = None,
        watcher: ProgressCallbacks | None = None,
    ) -> Document:
        """Run the scenario and return the document of results, as `a7sim run --json` prints it.

        With a `link`, the URL of an instrument served anew from the same scenario and seed, that instrument is used, as
        by `a7sim operate`. With `out` the files of the session are written there. Raises A7SimError; an operator who
        gives up is no error but a `status` with a `message`.
        """
        options = RunOptions(None if out is None else Path(out), force, watcher or ProgressCallbacks())
        if link is None:
            return run_all_methods(self.scenario, self.seed, options)
        if "plotter" not in self.scenario.work:
            ways = ", ".join(self.scenario.work)
            raise A7SimError(f"{self.scenario.title}: expected work at the plotter for the operator, got {ways}")
        with open_checked_port(link, timeout, token) as served:
            linked = replace(options, port_adapter=lambda twin: TwinCheckedPort(served, twin, link))
            return run_all_methods(self.scenario, self.seed, linked)

    work = RenamedMember("run")


@dataclass(frozen=True)
class Study:
    """Monte Carlo study of a scenario in all cells of a design.

    >>> from a7sim import Study
    >>> study = Study.load("levels", replicates=2)
    >>> study.loaded.study.design, len(study.loaded.cells)
    ('full', 7)
    """

    loaded: LoadedStudy

    @classmethod
    def load(cls, name: Name, replicates: int | None = None) -> Self:
        """Return a study of a file, or of one that comes with a7sim. Raises A7SimError with all errors."""
        return cls(load_study(Path(name), replicates))

    def run(self, out: Name | None = None, workers: int = 1, *, force: bool = False) -> Document:
        """Run all cells and return the document of findings, as `a7sim study --json` prints it.

        Several `workers` are processes: a script must call this below `if __name__ == "__main__":`. With `out` the
        tables are written there, and an interrupted study continues. Raises A7SimError.
        """
        folder = None if out is None else Path(out)
        tally = open_tally(self.loaded, folder, force)
        with open_executor("process") if workers == 1 else open_executor("pool", workers) as (executor, at_once):
            run_study(self.loaded, tally, executor, at_once, checkpoint_path(folder) if folder is not None else None)
        document = findings_document(self.loaded, tally)
        if folder is not None:
            write_results(folder, self.loaded, tally, document)
        return document

    work = RenamedMember("run")
    laid = RenamedMember("loaded")


def _resolve(scenario: Name | Scenario, seed: int | None) -> tuple[Scenario, int]:
    loaded = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
    return loaded, loaded.seed if seed is None else seed
