"""Every way in which a scenario asks for its strip: an operator at the plotter, the comparator, or both (P)."""

from collections.abc import Mapping
from pathlib import Path

from a7sim.documents import Document, as_json, of_differences
from a7sim.mistakes import Mistake
from a7sim.reduction import Undetermined
from a7sim.scenario import Scenario
from a7sim.scene import Scene, build_scene
from a7sim.session import results
from a7sim.session.a8_strip import strip_on_a8
from a7sim.session.analytical import StripResult, strip_by_comparator
from a7sim.session.folder import MODELS_OF_WAY, RESULTS, STRIP_OF_WAY, prepare_folder, write_whole
from a7sim.session.journal import Keeping
from a7sim.session.running import Cable, Watcher, run, straight
from a7sim.session.strips import of_grounded
from a7sim.session.two_ways import differences


def run_all_ways(
    scenario: Scenario,
    seed: int,
    out: Path | None = None,
    watcher: Watcher | None = None,
    force: bool = False,
    cable: Cable = straight,
    keeping: Keeping | None = None,
) -> Document:
    """Measure the strip of a scenario in every way it asks for and return the document of results.

    A plotter is worked by an operator over the link (`run`). What the comparator gives, and readings of an A8 simulated
    as arrays, its elements standing where a hand leaves them and not on counts, stands under `ways`.
    Raises Mistake for what does not make a strip.
    """
    if "plotter" in scenario.work:
        document = run(scenario, seed, out, watcher, force, cable, keeping)
    else:
        document = results.header(scenario, seed) | {"status": "complete", "message": ""}
        if out is not None:
            prepare_folder(out, force)
    strips = _computed(scenario, build_scene(scenario, seed), seed)
    document |= _of_ways(strips)
    if out is not None and strips:
        for name, each in strips.items():
            write_whole(out / MODELS_OF_WAY.format(name.lower()), results.models_csv(each.models))
            write_whole(out / STRIP_OF_WAY.format(name.lower()), results.points_csv(each.strip.points))
        write_whole(out / RESULTS, as_json(document))
    return document


def results_by_computing(scenario: Scenario, scene: Scene, seed: int) -> Document:
    """Return what `run_all_ways` says of the ways that need no operator; nothing where the scenario asks for none."""
    return _of_ways(_computed(scenario, scene, seed))


def _of_ways(strips: Mapping[str, StripResult]) -> Document:
    document: Document = {}
    if strips:
        document["ways"] = {name: of_grounded(each.strip) for name, each in strips.items()}
    if len(strips) > 1:
        document["a8_minus_comparator_m"] = of_differences(differences(strips["comparator"], strips["A8"]))
    return document


def _computed(scenario: Scenario, scene: Scene, seed: int) -> dict[str, StripResult]:
    ways = {}
    try:
        if "comparator" in scenario.work:
            ways["comparator"] = strip_by_comparator(scenario, scene, seed)
        if "readings" in scenario.work:
            ways["A8"] = strip_on_a8(scenario, scene, seed)
    except Undetermined as undetermined:
        raise Mistake(f"{scenario.title}: {undetermined}") from undetermined
    return ways
