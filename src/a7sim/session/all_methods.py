"""Strip of a scenario by all its methods: plotter, bridging, comparator, A8 (P)."""

from collections.abc import Callable, Sequence

import msgspec

from a7sim.errors import A7SimError
from a7sim.journal.session_files import MODELS_OF_WAY, RESULTS, STRIP_OF_WAY, prepare_folder, write_atomic
from a7sim.reduction import Undetermined
from a7sim.result_documents import Document, as_json
from a7sim.scenario import Scenario
from a7sim.scene import Scene, SharedScene, build_scene
from a7sim.session.bridge import bridge_batch, bridge_over_link
from a7sim.session.lifecycle import RunOptions
from a7sim.session.result_records import BridgeResult, SessionResult
from a7sim.session.results import models_csv, points_csv, session_document
from a7sim.session.running import measure_session
from a7sim.session.session_batch import open_batch
from a7sim.strip_methods.a8_strip import strip_on_a8
from a7sim.strip_methods.comparator import strip_by_comparator
from a7sim.strip_methods.strip import StripResult


def run_all_methods(scenario: Scenario, seed: int, options: RunOptions | None = None) -> Document:
    """Measure the strip of a scenario by all its methods and return the document of results.

    At the plotter the operator works over the link (`measure_session`). The strips of the comparator, of an A8
    simulated as arrays, with elements between counts, and of bridging over the link are under `ways` (`a7sim bridge`
    also writes the journal and the book of bridging). Raises A7SimError for measurements that form no strip.
    """
    return session_document(measure_all_methods(scenario, seed, options))


def measure_all_methods(scenario: Scenario, seed: int, options: RunOptions | None = None) -> SessionResult:
    """Measure the strip of a scenario by all its methods; with a folder, write the files.

    Raises A7SimError for measurements that form no strip.
    """
    options = options or RunOptions()
    folder = options.folder
    if "plotter" in scenario.work:
        result = measure_session(scenario, seed, options)
    else:
        result = SessionResult(scenario, seed)
        if folder is not None:
            prepare_folder(folder, options.force)
    result = _with_other_methods(result, build_scene(scenario, seed), bridge_over_link)
    if folder is not None and result.methods:
        for name, each in result.methods.items():
            write_atomic(folder / MODELS_OF_WAY.format(name.lower()), models_csv(each.models))
            write_atomic(folder / STRIP_OF_WAY.format(name.lower()), points_csv(each.strip.points))
        write_atomic(folder / RESULTS, as_json(session_document(result)))
    return result


def run_all_methods_batch(
    scenario: Scenario, seeds: Sequence[int], strips: bool = True, whole: bool = True
) -> list[Document]:
    """Return the document of `run_all_methods` for each seed from one batch, without lines and book.

    Without `strips` the strip on the ground measured at the plotter is left out; unless `whole`, the models contain
    only the values of named responses of a study.
    """
    return [session_document(each, brief=not whole) for each in measure_all_methods_batch(scenario, seeds, strips)]


def measure_all_methods_batch(scenario: Scenario, seeds: Sequence[int], strips: bool = True) -> list[SessionResult]:
    """Return the result of `measure_all_methods` for each seed from one batch, without lines and book.

    Without `strips` the strip on the ground measured at the plotter is not computed.
    """
    if "plotter" in scenario.work:
        results = open_batch(scenario, seeds).measure(strips)
    else:
        results = [SessionResult(scenario, seed) for seed in seeds]
    if scenario.work == ["plotter"]:
        return results
    bridgings = dict(zip(seeds, bridge_batch(scenario, seeds), strict=True)) if "bridge" in scenario.work else {}
    flight = SharedScene.of(scenario)
    return [_with_other_methods(each, flight.scene(each.seed), lambda _, seed: bridgings[seed]) for each in results]


def _with_other_methods(
    result: SessionResult, scene: Scene, bridge: Callable[[Scenario, int], BridgeResult]
) -> SessionResult:
    """Return a result with the strips of all methods of its scenario other than the plotter."""
    scenario, seed = result.scenario, result.seed
    methods: dict[str, StripResult] = {}
    try:
        if "comparator" in scenario.work:
            methods["comparator"] = strip_by_comparator(scenario, scene, seed)
        if "readings" in scenario.work:
            methods["A8"] = strip_on_a8(scenario, scene, seed)
        bridging = bridge(scenario, seed) if "bridge" in scenario.work else None
    except Undetermined as undetermined:
        raise A7SimError(f"{scenario.title}: {undetermined}") from undetermined
    if bridging is not None and bridging.result is not None:
        methods["bridge"] = bridging.result
    if bridging is not None and bridging.message and result.status == "complete":
        result = msgspec.structs.replace(result, status="does not fit", message=bridging.message)
    return msgspec.structs.replace(result, methods=methods, bridging=bridging)
