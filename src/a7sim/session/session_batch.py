"""Batch of sessions of a scenario: the operator's procedures on a batch of instruments as arrays."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from a7sim.instrument.autograph_batch import AutographBatch, build_batch
from a7sim.operator import Job
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.operator.people.random_draws import OperatorRandom
from a7sim.operator.procedures.models import ModelRecordBatch, measure_models_batch
from a7sim.result_documents import Document
from a7sim.scenario import Scenario
from a7sim.scene import RelativeTruth, Scene, SharedScene
from a7sim.session.batch_driver import BatchDriver
from a7sim.session.lifecycle import make_job
from a7sim.session.result_records import ModelResult, SessionResult
from a7sim.session.results import hours_document, session_document
from a7sim.session.running import with_strip
from a7sim.session.truth import TruthComparison
from a7sim.strip_methods.strip import ground_control


@dataclass(frozen=True)
class SessionBatch:
    """Sessions of a scenario, one per seed, ready to start."""

    scenario: Scenario
    seeds: tuple[int, ...]
    scenes: tuple[Scene, ...]
    batch: AutographBatch
    workstation: Workstation
    job: Job

    def measure_models(self) -> Iterator[ModelRecordBatch]:
        """Yield the models as they are measured.

        `workstation.operators.reasons` contains the reasons of the sessions that give up.
        """
        return measure_models_batch(self.workstation)

    def run(self, strips: bool = True) -> list[Document]:
        """Run to the end and return a document per seed, as `run` does, without lines and book."""
        return [session_document(each) for each in self.measure(strips)]

    def measure(self, strips: bool = True) -> list[SessionResult]:
        """Run to the end and return a result per seed, without lines and book.

        Without `strips` they do not contain the strip on the ground, which doubles the time.
        """
        models: list[list[ModelResult]] = [[] for _ in self.seeds]
        for records in self.measure_models():
            planned_model = next(model for model in self.scenario.models if model.name == records.model.name)
            comparison = self._compare_with_truth(records, self.scenes[0].relative_truth(planned_model))
            for member, session in enumerate(records.sessions.tolist()):
                models[session].append(
                    ModelResult(records.for_session(session), comparison, member, planned_model.published)
                )
        return [self._result(session, models[session], strips) for session in range(len(self.seeds))]

    def _compare_with_truth(self, records: ModelRecordBatch, truth: RelativeTruth | None) -> TruthComparison:
        """Return the truth about a model of the sessions that measured it; their instruments are in the final state."""
        active, model, batch = records.sessions, records.model, self.batch
        centres = {
            side: {
                f"{axis}0": readings
                for axis, readings in batch.readings_at(active, batch.pose(active, projector)[0]).items()
            }
            for side, projector in ((1, model.left_projector), (2, model.right_projector))
        }
        elements = {name: counts[active] for name, counts in records.orientation.elements.items()}
        return TruthComparison.of(truth, centres, records.orientation.method, elements, model, batch.variant)

    def _result(self, session: int, models: Sequence[ModelResult], strips: bool) -> SessionResult:
        operators, scenario = self.workstation.operators, self.scenario
        reason = operators.reasons.get(session)
        result = SessionResult(
            scenario,
            self.seeds[session],
            "complete" if reason is None else "does not fit",
            reason or "",
            tuple(models),
            hours_document(float(operators.seconds[session]), operators.timesheet, session),
        )
        if strips and reason is None:
            return with_strip(result, ground_control(scenario, self.scenes[session]))
        return result


def open_batch(scenario: Scenario, seeds: Sequence[int]) -> SessionBatch:
    """Return sessions of a scenario, one per seed, each equal to the digit to `run` for that seed."""
    flight = SharedScene.of(scenario)
    scenes = tuple(flight.scene(seed) for seed in seeds)
    batch = build_batch(scenario.instrument, [scene.mountable for scene in scenes], seeds)
    operators = OperatorBatch(scenario.observer, [OperatorRandom(scenario.observer, seed) for seed in seeds])
    job = make_job(scenario, scenes[0])
    return SessionBatch(scenario, tuple(seeds), scenes, batch, Workstation(operators, BatchDriver(batch), job), job)
