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
from a7sim.session import results
from a7sim.session.batch_driver import BatchDriver
from a7sim.session.running import make_job, strip_document
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

    def run(self, strips: bool = True, whole: bool = True) -> list[Document]:
        """Run to the end and return a document per seed, as `run` does, without lines and book.

        Without `strips` they do not contain the strip on the ground, which doubles the time; unless `whole`,
        the models contain only the keys of `brief_model_document`.
        """
        model_documents: list[list[Document]] = [[] for _ in self.seeds]
        for records in self.measure_models():
            planned_model = next(model for model in self.scenario.models if model.name == records.model.name)
            comparison = self._compare_with_truth(records, self.scenes[0].relative_truth(planned_model))
            for member, session in enumerate(records.sessions.tolist()):
                record = records.of(session)
                model_documents[session].append(
                    results.model_document(record, comparison, member, planned_model.published)
                    if whole
                    else results.brief_model_document(record, comparison, member)
                )
        return [self._document(session, models, strips) for session, models in enumerate(model_documents)]

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

    def _document(self, session: int, models: list[Document], strips: bool) -> Document:
        operators, scenario = self.workstation.operators, self.scenario
        reason = operators.reasons.get(session)
        document: Document = results.results_header(scenario, self.seeds[session]) | {
            "status": "complete" if reason is None else "does not fit",
            "message": reason or "",
            "models": models,
            "operator": results.hours_document(float(operators.seconds[session]), operators.timesheet, session),
        }
        if strips and reason is None:
            document["strip"], _ = strip_document(scenario, ground_control(scenario, self.scenes[session]), models)
        return document


def open_batch(scenario: Scenario, seeds: Sequence[int]) -> SessionBatch:
    """Return sessions of a scenario, one per seed, each equal to the digit to `run` for that seed."""
    flight = SharedScene.of(scenario)
    scenes = tuple(flight.scene(seed) for seed in seeds)
    batch = build_batch(scenario.instrument, [scene.mountable for scene in scenes], seeds)
    operators = OperatorBatch(scenario.observer, [OperatorRandom(scenario.observer, seed) for seed in seeds])
    job = make_job(scenario, scenes[0])
    return SessionBatch(scenario, tuple(seeds), scenes, batch, Workstation(operators, BatchDriver(batch), job), job)
