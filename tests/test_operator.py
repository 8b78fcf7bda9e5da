"""Work of the operator through the eyepieces: orientation, centres, coordinates, and giving up."""

import dataclasses
import re
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from itertools import product
from pathlib import Path

import msgspec
import numpy as np
import pytest

from a7sim.geometry import GON
from a7sim.operator import OperatorGaveUp, measure_models
from a7sim.operator.driving.controls import wrap_gon
from a7sim.scenario import Observer, load_scenario
from a7sim.session import open_session, run
from a7sim.session.session_batch import open_batch
from tests.support.sessions import element_errors, read_once, tampered_session, tilted_flight, without_errors

CASES = "ABCDE"
SCENARIOS = Path(__file__).parents[1] / "scenarios"
SEEDS = range(10)


def _run_case(case):
    return open_batch(load_scenario("akwanga", {"plan.case": f'"{case}"'}), SEEDS).run()


@cache
def sweep():
    """Akwanga with its default operator, cases A to E, ten seeds each."""
    with ProcessPoolExecutor(2) as pool:
        return [document for documents in pool.map(_run_case, CASES) for document in documents]


def models_of_sweep():
    return [model for document in sweep() for model in document["models"]]


def centres_of_sweep():
    return [
        (model["perspective_centres"][side], model["truth"]["centre_differences"][side])
        for model in models_of_sweep()
        for side in ("left", "right")
    ]


@pytest.mark.slow
def test_every_session_of_the_sweep_ends():
    assert [document["message"] for document in sweep() if document["status"] != "complete"] == []
    assert len(models_of_sweep()) == 100


@pytest.mark.slow
def test_residual_parallaxes_equal_the_thesis_or_are_smaller():
    """T: 0.019 to 0.076 mm at model scale, over all fifteen points."""
    rms = [model["relative_orientation"]["rms_parallax_mm"] for model in models_of_sweep()]
    assert np.median(rms) < 0.025
    assert max(rms) < 0.05
    assert min(rms) > 0.003
    assert all(len(model["relative_orientation"]["residual_parallax_mm"]) == 15 for model in models_of_sweep())


@pytest.mark.slow
def test_centres_are_as_uncertain_as_the_theses():
    """T's twenty: rms 0.059 to 0.187, sigma X0 0.033 to 0.096, sigma Z0 0.48 to 1.34 counter units."""
    for centre, _ in centres_of_sweep():
        assert 0.03 < centre["rms"] < 0.25
        assert 0.02 < centre["sigma_X0"] < 0.12
        assert 0.3 < centre["sigma_Z0"] < 1.6


@pytest.mark.slow
def test_true_centres_lie_within_three_sigmas():
    within = [
        abs(difference[name]) <= 3.0 * centre[f"sigma_{name}"]
        for centre, difference in centres_of_sweep()
        for name in ("X0", "Y0", "Z0")
    ]
    assert np.mean(within) >= 0.95


@pytest.mark.slow
def test_the_truth_is_near_and_never_met_exactly():
    off = [model["truth"]["rotation_difference_gon"] for model in models_of_sweep()]
    assert min(off) > 0.0
    assert np.median(off) < 0.02
    assert max(off) < 0.05


TILTS = {
    "as flown": [(0.62, -0.48, 0.35), (-0.35, 0.57, -0.79), (0.88, 0.21, 0.92)],
    "five gon of omega": [(5.0, 0.0, 1.0), (-3.0, 0.5, -1.0), (4.0, -0.5, 0.0)],
    "five gon of phi": [(0.5, 2.5, 0.0), (0.0, -2.5, 1.0), (-0.5, 2.5, -1.0)],
    "five gon of swing": [(0.5, 0.3, 5.0), (0.0, -0.6, -5.0), (-0.5, 0.4, 5.0)],
    "five gon of everything": [(5.0, -2.0, 3.0), (1.0, 3.0, 5.0), (-3.0, -2.0, -5.0)],
}


@pytest.mark.parametrize(
    ("tilts", "method"),
    [
        *product(("as flown", "five gon of omega", "five gon of everything"), ("independent", "dependent")),
        *(("five gon of phi", "independent"), ("five gon of swing", "dependent")),
    ],
)
def test_without_errors_the_exact_solution_is_found_at_any_tilt_and_base(tilts, method):
    """Counters still read to 0.01: elements within 0.02 gon, centres within 0.1 in X and Y and 1.0 in Z.

    Photographs differ in phi and in swing as much in "everything", by both methods, as in phi or swing alone.
    """
    document = run(tilted_flight(TILTS[tilts], **{"plan.method": f'"{method}"'}), 4)
    assert document["message"] == ""
    assert [model["base"] for model in document["models"]] == ["inside", "outside"]
    for model in document["models"]:
        errors = element_errors(model)
        beside = {name: model["truth"]["element_differences"][name] for name in errors}
        assert beside == pytest.approx(errors, abs=1e-5)
        assert max(abs(error) for error in errors.values()) < 0.02, (model["model"], errors)
        for difference in model["truth"]["centre_differences"].values():
            assert abs(difference["X0"]) < 0.1
            assert abs(difference["Y0"]) < 0.1
            assert abs(difference["Z0"]) < 1.0


def test_the_second_model_is_as_good_as_the_first():
    """Base out, photograph 102 stays where it is, 103 goes into the other projector."""
    session = open_session(without_errors(load_scenario("akwanga")), 2)
    loaded = []
    for record in measure_models(session.person, session.job):
        loaded.append((session.autograph.loaded(1), session.autograph.loaded(2)))
        assert record.orientation.rms < 0.02
    assert loaded == [("101", "102"), ("103", "102")]
    assert session.autograph.base_mode == "outside"
    assert session.autograph.carrier(2).centring != (0.0, 0.0, 0.0)


def test_model_coordinates_are_the_ground_at_model_scale():
    """Similarity of the measured model to the true ground: what remains is counter reading and residual parallax."""
    session = open_session(without_errors(load_scenario("akwanga", {"camera.principal_point": "[0.0, 0.0]"})), 3)
    for record in measure_models(session.person, session.job):
        names = list(record.points)
        model = np.array([record.points[name] for name in names]).T / np.array([[1.0], [1.0], [record.z_units_per_mm]])
        ground = np.array([session.scene.ground_points[name] for name in names]).T
        model, ground = (each - each.mean(axis=1, keepdims=True) for each in (model, ground))
        u, spread, v = np.linalg.svd(ground @ model.T)
        turned = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
        scale = (spread * [1.0, 1.0, np.linalg.det(u @ v)]).sum() / (model**2).sum()
        assert 3600.0 < 1000.0 * scale < 3900.0
        assert np.abs(ground / scale - turned @ model).max() < 0.05
        assert {"C1", "K1", "1011", "1025"} <= set(names) or {"C5", "K6", "1031"} <= set(names)


@pytest.mark.parametrize("method", ["independent", "dependent"])
def test_the_real_pair_orients_as_published(method):
    """Reference 03, default operator at zero noise: within 0.03 gon."""
    document = run(without_errors(load_scenario("dewitt-pair", {"plan.method": f'"{method}"'})), 3)
    (model,) = document["models"]
    assert model["truth"]["rotation_difference_gon"] < 0.03
    assert model["truth"]["base_difference_gon"] < 0.03


@pytest.mark.parametrize("method", ["independent", "dependent"])
def test_with_noise_the_real_pair_lies_within_the_published_sigmas_and_the_operators(method):
    published = load_scenario("dewitt-pair").models[0].published
    scenario = read_once(load_scenario("dewitt-pair", {"plan.method": f'"{method}"'}))
    for document in open_batch(scenario, range(6)).run():
        (model,) = document["models"]
        sigmas = next(r["sigmas"] for r in reversed(model["relative_orientation"]["rounds"]) if r["sigmas"])
        of_operator = np.hypot.reduce([value for name, value in sigmas.items() if not name.startswith("b")])
        of_print = np.hypot.reduce([published.sigma_omega, published.sigma_phi, published.sigma_kappa])
        assert model["truth"]["rotation_difference_gon"] < 3.0 * np.hypot(of_operator, of_print)
        across = np.hypot(published.sigma_by, published.sigma_bz) / published.base[0] / GON
        assert model["truth"]["base_difference_gon"] < 3.0 * np.hypot(of_operator, across)


def test_a_blunder_is_caught_by_comparing_by_and_by_and_struck_out():
    """T 3.4.2: both by' and by" are read at every point to guard against blunders."""
    session = open_session(load_scenario("akwanga", {"observer.blunder_rate": "0.06"}), 5)
    record = next(iter(measure_models(session.person, session.job)))
    struck = [e for e in session.person.book.entries if e.struck and e.item in ("by1", "by2")]
    assert len(struck) >= 5
    for entry in struck:
        neighbours = [
            float(e.reading) * (1.0 if e.item == "by1" else -1.0)
            for e in session.person.book.entries
            if (e.point, e.round, e.form) == (entry.point, entry.round, entry.form)
            and e.item in ("by1", "by2")
            and not e.struck
            and abs(e.number - entry.number) < 9
        ]
        sense = 1.0 if entry.item == "by1" else -1.0
        assert min(abs(sense * float(entry.reading) - neighbour) for neighbour in neighbours) > 0.03
    assert record.orientation.rms < 0.05


def test_without_slips_nothing_of_by_is_struck_out():
    session = open_session(load_scenario("akwanga", {"observer.blunder_rate": "0", "observer.last_digit_slip": "0"}), 5)
    next(iter(measure_models(session.person, session.job)))
    assert [e for e in session.person.book.entries if e.struck and e.item in ("by1", "by2")] == []


def test_two_pointings_of_every_model_point_agree_within_a_hundredth():
    session = open_session(read_once(load_scenario("akwanga")), 6)
    next(iter(measure_models(session.person, session.job)))
    kept = [
        e for e in session.person.book.entries if e.form == "model coordinates" and e.item in "XYZ" and not e.struck
    ]
    for point in {e.point for e in kept}:
        for axis, tolerance in (("X", 0.01), ("Y", 0.01), ("Z", 0.08)):
            first, second = (float(e.reading) for e in kept if (e.point, e.item) == (point, axis))
            assert abs(first - second) <= tolerance + 1e-9


def test_three_readings_of_by_and_three_of_by_are_taken_at_every_point():
    session = open_session(msgspec.structs.replace(load_scenario("akwanga"), observer=Observer.faultless()), 1)
    record = next(iter(measure_models(session.person, session.job)))
    readings = [e for e in session.person.book.entries if e.item in ("by1", "by2")]
    rounds = len(record.orientation.rounds)
    assert len([e for e in readings if e.point == "1011"]) == 6 * (rounds + 1)
    assert len([e for e in readings if e.point == "1d"]) == 6


@pytest.mark.slow
def test_the_mean_parallax_is_set_on_by():
    document = sweep()[len(SEEDS) * CASES.index(load_scenario("akwanga").plan.case) + 8]
    assert document["seed"] == 8
    for model in document["models"]:
        residuals = np.array(list(model["relative_orientation"]["residual_parallax_mm"].values()))
        assert abs(residuals.mean()) < 0.012
        assert model["relative_orientation"]["elements"]["by2"] == 0.0


def test_dependent_orientation_leaves_the_photograph_that_is_oriented_already():
    document = run(read_once(load_scenario("akwanga", {"plan.method": '"dependent"'})), 8)
    first, second = (model["relative_orientation"]["elements"] for model in document["models"])
    assert [first[name] for name in ("kappa1", "phi1", "omega1", "by1", "bz1")] == [0.0, 100.0, 100.0, 0.0, 0.0]
    stays = ("kappa2", "phi2", "omega2", "by2", "bz2")
    assert [first[name] for name in stays] == [second[name] for name in stays]
    assert abs(wrap_gon(second["kappa1"])) > 0.5


def test_a_worn_instrument_disturbs_the_result():
    """Faults of the condition change the geometry; the operator does not know them."""
    worn = {
        "instrument.condition.left": "{ omega_zero_gon = 0.2, principal_point_um = [40.0, 0.0] }",
        "instrument.condition.backlash_mm": "0.02",
    }

    def truth_of(condition):
        scenario = read_once(load_scenario("akwanga", condition))
        return run(msgspec.structs.replace(scenario, models=scenario.models[:1]), 8)["models"][0]["truth"]

    sound, faulty = truth_of({}), truth_of(worn)
    assert faulty["rotation_difference_gon"] > 5.0 * sound["rotation_difference_gon"]


WRONG = {
    "swapped photographs": (
        [('PHOT1:LOAD "101"', 'PHOT1:LOAD "other"'), ('PHOT2:LOAD "102"', 'PHOT2:LOAD "101"'), ("other", "102")],
        "102 lies in it",
    ),
    "base lever wrong": ([("BASE:MODE IN", "BASE:MODE OUT")], "base"),
    "base lever wrong in model 2": ([("BASE:MODE OUT", "BASE:MODE IN")], "base"),
    "triangulation lever wrong": ([("FITT:TRI BACK", "FITT:TRI FRON")], "triangulation lever"),
    "Dove prisms wrong": ([("FITT:DOVE OUT", "FITT:DOVE IN")], "Dove prisms"),
    "diapositive lever wrong": ([("FITT:DIAP LEFT", "FITT:DIAP RIGH")], "diapositive lever"),
    "X collar wrong": ([("FITT:XCOL IN", "FITT:XCOL OUT")], "X wheel turns the wrong way"),
    "Y collar wrong": ([("FITT:YCOL OUT", "FITT:YCOL IN")], "Y wheel turns the wrong way"),
    "kappa spindle sets phi": ([("PROJ1:KAPP", "PROJ1:PHI")], "refuses"),
}


@pytest.mark.parametrize("what", list(WRONG))
def test_wrong_handling_fails_with_a_remark_that_names_it(what):
    exchanges, word = WRONG[what]
    session = tampered_session(read_once(load_scenario("akwanga")), exchanges)
    with pytest.raises(OperatorGaveUp) as error:
        list(measure_models(session.person, session.job))
    assert word in str(error.value)
    assert session.person.book.remarks[-1] == f"does not fit: {error.value}"


def test_a_picture_upside_down_in_its_carrier_is_found_at_the_fiducials():
    document = run(load_scenario("akwanga", {"photos.1.laid": '"upside down"'}), 1)
    assert document["status"] == "does not fit"
    assert "102 lies upside down in projector 2" in document["message"]
    assert document["models"] == []


def test_pictures_with_exchanged_names_are_detected_by_their_prints():
    """The pictures themselves have changed names: only the prints can show it."""
    session = open_session(load_scenario("akwanga"), 1)
    drawer = session.autograph._photographs
    drawer["101"], drawer["102"] = (
        dataclasses.replace(drawer["102"], name="101"),
        dataclasses.replace(drawer["101"], name="102"),
    )
    with pytest.raises(OperatorGaveUp, match="do not overlap towards each other"):
        list(measure_models(session.person, session.job))


def test_a_wrong_picture_under_the_right_name_and_print_is_detected():
    """Projector 1 shows 103's picture though name, print and fiducials are those of 101."""
    session = open_session(load_scenario("akwanga"), 1)
    drawer = session.autograph._photographs
    drawer["101"] = dataclasses.replace(drawer["101"], points=drawer["103"].points)
    with pytest.raises(OperatorGaveUp, match="nowhere near where the print shows it"):
        list(measure_models(session.person, session.job))


def test_a_misidentified_point_does_not_pass_for_a_model(tmp_path):
    """4 mm in one image coordinate: residuals far beyond what is tolerated, and the operator says so."""
    folder = SCENARIOS
    rows = (folder / "dewitt-pair.csv").read_text(encoding="utf-8").replace("-94.319", "-90.319")
    (tmp_path / "dewitt-pair.csv").write_text(rows, encoding="utf-8")
    (tmp_path / "pair.toml").write_bytes((folder / "dewitt-pair.toml").read_bytes())
    document = run(load_scenario(tmp_path / "pair.toml"), 1)
    assert document["status"] == "does not fit"
    assert "rms remain" in document["message"]


def test_pointings_that_do_not_meet_do_not_pass_for_a_centre():
    document = run(read_once(load_scenario("akwanga", {"observer.monocular_um": "200"})), 1)
    assert document["status"] == "does not fit"
    assert "perspective centre do not meet" in document["message"]


def test_nothing_that_crosses_the_link_depends_on_the_stations_or_the_ground():
    """The same film from another flight: every reply is the same but for the picture content."""
    scenario = read_once(load_scenario("akwanga"))
    event_lists = []
    for shift in (0.0, 5000.0):
        lines = []
        session = open_session(scenario, 1, lambda event, lines=lines: lines.append((event.direction, event.text)))
        scene = session.scene
        for name, station in scene.stations.items():
            scene.stations[name] = dataclasses.replace(station, centre=station.centre + shift)
        for name in scene.ground_points:
            scene.ground_points[name] = scene.ground_points[name] + 2.0 * shift
        next(iter(measure_models(session.person, session.job)))
        event_lists.append([each for each in lines if each[0] in "<>"])
    assert event_lists[0] == event_lists[1]


def test_faults_of_the_instrument_show_only_through_the_eyepieces():
    """No counter, self-test or other reply tells a worn instrument from a sound one."""
    optical = ("EYEPiece", "PHOTo<n>:FID")
    scenario = load_scenario("akwanga")
    worn = load_scenario(
        "akwanga",
        {
            "instrument.condition.left": "{ principal_distance_mm = 0.5, phi_zero_gon = 0.3, by_zero_mm = 0.2 }",
            "instrument.condition.carriage_scale_ppm": "[300.0, 200.0, 100.0]",
        },
    )
    clients = [open_session(each, 1).person.client for each in (scenario, worn)]
    setting_up = 'PHOT1:LOAD "101";:PHOT2:LOAD "102";:BASE:BX 190;:DRIV:X 3;Y 4;:PROJ1:PHI 101.5;BY 3;:REC "a",BY1'
    arguments = {"EYEPiece<n>?": ' "1011"', "EYEPiece:STEReo?": ' "1011"', "EYEPiece<n>:PICTure?": " 4,4,1"}
    replies = []
    for client in clients:
        client.send(setting_up)
        client.check(setting_up)
        queries = [h for h in client.fields("SYST:HELP:HEAD?") if h.endswith("?") and not h.startswith("COMMon")]
        replies.append({q: _reply(client, q, arguments.get(q, "")) for q in queries})
    different = {query for query in replies[0] if replies[0][query] != replies[1][query]}
    assert "EYEPiece<n>?" in different
    assert all(query.startswith(optical) for query in different)
    assert len(replies[0]) > 40


def _reply(client, header, arguments):
    """The bytes of a reply; a picture's block is read by its length."""
    line = re.sub(r"<n>|\[[^]]*\]", lambda found: "1" if found[0] == "<n>" else "", header) + arguments
    client.send(line)
    return client._port.read(4 + 16 + 1) if "PICT" in line else client._port.readline()
