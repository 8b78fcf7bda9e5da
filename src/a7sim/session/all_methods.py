"""All methods by which a scenario measures its strip: at the plotter, bridging, comparator, A8 (P)."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.journal.session_files import MODELS_OF_WAY, RESULTS, STRIP_OF_WAY, prepare_folder, write_atomic
from a7sim.journal.writer import JournalOptions
from a7sim.reduction import Undetermined
from a7sim.result_documents import Document, as_json, differences_document
from a7sim.scenario import Scenario
from a7sim.scene import Scene, SharedScene, build_scene
from a7sim.session import results
from a7sim.session.bridge import BridgeResult, bridge_batch, bridge_over_link
from a7sim.session.running import PortAdapter, ProgressCallbacks, direct, run
from a7sim.session.session_batch import open_batch
from a7sim.strip_methods.a8_strip import strip_on_a8
from a7sim.strip_methods.a8_vs_comparator import coordinate_differences
from a7sim.strip_methods.comparator import StripResult, strip_by_comparator
from a7sim.strip_methods.strip import oriented_strip_document


def run_all_methods(
    scenario: Scenario,
    seed: int,
    out: Path | None = None,
    watcher: ProgressCallbacks | None = None,
    force: bool = False,
    port_adapter: PortAdapter = direct,
    journal_options: JournalOptions | None = None,
) -> Document:
    """Measure the strip of a scenario by all its methods and return the document of results.

    At the plotter the operator works over the link (`run`). The strips of the comparator, of an A8 simulated as arrays,
    with elements between counts, and of bridging over the link are under `ways` (`a7sim bridge` also writes the journal
    and the book of bridging). Raises A7SimError for measurements that form no strip.
    """
    if "plotter" in scenario.work:
        document = run(scenario, seed, out, watcher, force, port_adapter, journal_options)
    else:
        document = results.results_header(scenario, seed) | {"status": "complete", "message": ""}
        if out is not None:
            prepare_folder(out, force)
    strips, messages = _measured(scenario, build_scene(scenario, seed), seed, bridge_over_link)
    _add(document, strips, messages)
    if out is not None and strips:
        for name, each in strips.items():
            write_atomic(out / MODELS_OF_WAY.format(name.lower()), results.models_csv(each.models))
            write_atomic(out / STRIP_OF_WAY.format(name.lower()), results.points_csv(each.strip.points))
        write_atomic(out / RESULTS, as_json(document))
    return document


def run_all_methods_batch(
    scenario: Scenario, seeds: Sequence[int], strips: bool = True, whole: bool = True
) -> list[Document]:
    """Return the results of `run_all_methods` for each seed as a batch, without lines and book.

    Without `strips` the strip on the ground measured at the plotter is left out; unless `whole`, the models contain
    only the values of named responses of a study.
    """
    if "plotter" in scenario.work:
        documents = open_batch(scenario, seeds).run(strips, whole)
    else:
        documents = [results.results_header(scenario, seed) | {"status": "complete", "message": ""} for seed in seeds]
    if scenario.work == ["plotter"]:
        return documents
    bridgings = dict(zip(seeds, bridge_batch(scenario, seeds), strict=True)) if "bridge" in scenario.work else {}
    flight = SharedScene.of(scenario)
    for document, seed in zip(documents, seeds, strict=True):
        _add(document, *_measured(scenario, flight.scene(seed), seed, lambda _, seed: bridgings[seed]))
    return documents


def _add(document: Document, strips: Mapping[str, StripResult], bridging: BridgeResult | None) -> None:
    """Add to a document the results of the methods other than the plotter."""
    if strips:
        document["ways"] = {name: oriented_strip_document(each.strip) for name, each in strips.items()}
    if bridging is not None:
        document.setdefault("operator", bridging.operator)
        if bridging.message and document["status"] == "complete":
            document |= {"status": "does not fit", "message": bridging.message}
    if "comparator" in strips and "A8" in strips:
        document["a8_minus_comparator_m"] = differences_document(
            coordinate_differences(strips["comparator"], strips["A8"])
        )


def _measured(
    scenario: Scenario, scene: Scene, seed: int, bridge: Callable[[Scenario, int], BridgeResult]
) -> tuple[dict[str, StripResult], BridgeResult | None]:
    """Return the strips of all methods but the plotter's, by name, and the result of bridging if requested."""
    ways = {}
    bridging = None
    try:
        if "comparator" in scenario.work:
            ways["comparator"] = strip_by_comparator(scenario, scene, seed)
        if "readings" in scenario.work:
            ways["A8"] = strip_on_a8(scenario, scene, seed)
        if "bridge" in scenario.work:
            bridging = bridge(scenario, seed)
            if bridging.result is not None:
                ways["bridge"] = bridging.result
    except Undetermined as undetermined:
        raise A7SimError(f"{scenario.title}: {undetermined}") from undetermined
    return ways, bridging
