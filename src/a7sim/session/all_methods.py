"""Every way in which a scenario asks for its strip: at the plotter, bridged there, by comparator, on an A8 (P)."""

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
    """Measure the strip of a scenario in every way it asks for and return the document of results.

    A plotter is worked by an operator over the link (`run`). What the comparator gives, and readings of an A8 simulated
    as arrays, its elements standing where a hand leaves them and not on counts, stands under `ways`, as does a strip
    that was bridged over the link (`a7sim bridge` also leaves the journal and the book of bridging).
    Raises Mistake for what does not make a strip.
    """
    if "plotter" in scenario.work:
        document = run(scenario, seed, out, watcher, force, port_adapter, journal_options)
    else:
        document = results.results_header(scenario, seed) | {"status": "complete", "message": ""}
        if out is not None:
            prepare_folder(out, force)
    strips, said = _measured(scenario, build_scene(scenario, seed), seed, bridge_over_link)
    _add(document, strips, said)
    if out is not None and strips:
        for name, each in strips.items():
            write_atomic(out / MODELS_OF_WAY.format(name.lower()), results.models_csv(each.models))
            write_atomic(out / STRIP_OF_WAY.format(name.lower()), results.points_csv(each.strip.points))
        write_atomic(out / RESULTS, as_json(document))
    return document


def run_all_methods_batch(
    scenario: Scenario, seeds: Sequence[int], strips: bool = True, whole: bool = True
) -> list[Document]:
    """Return what `run_all_ways` says of each seed, all sessions at once, without what is told of line and book.

    Without `strips` nothing is said of the strip on the ground that was measured at the plotter; where they are not
    `whole`, of its models only what the responses of a study that have names are read from.
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
    """Add to a document what the ways beside the plotter came to."""
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
    """Return the strips of all ways but the plotter's, by their names, and how bridging went where it is asked for."""
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
