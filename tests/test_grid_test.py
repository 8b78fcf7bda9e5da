"""Grid test: errors of a projector, its perspective centre, and the service sheet of `a7sim calibrate`."""

import csv
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim.errors import A7SimError
from a7sim.geometry import GON, at_level, ray_of, rotation
from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.operator import measure_models
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.procedures.grid_test import GridTestPlan, level_heights, measure_grid, measure_grid_batch
from a7sim.plotters import VARIANTS
from a7sim.reduction import Elements, Undetermined, grid_test, perspective_centre_of_levels, plate_placement
from a7sim.reduction.grid_test import HELD_AT_ONE_LEVEL, UNKNOWNS
from a7sim.scenario import GridPlate, ScenarioError, load_scenario
from a7sim.scene import build_scene
from a7sim.session import open_session, run
from a7sim.session.grid_test import run_grid_test
from a7sim.session.session_batch import open_batch
from tests.support.engine_client import EngineClient
from tests.support.hypothesis_profile import examples
from tests.support.processes import a7sim_in_process
from tests.support.sessions import read_once, without_errors

ROOT = Path(__file__).parents[1]
CROSSES = np.array(list(GridPlate().some_crosses(25).values())).T
LEVELS = (-210.0, -415.0)
ANGLES = ("omega", "phi", "kappa")

FAULTS = {
    "left": {
        "principal_distance_mm": 0.02,
        "principal_point_um": [15.0, -10.0],
        "omega_zero_gon": -0.02,
        "phi_zero_gon": 0.03,
        "kappa_zero_gon": 0.01,
        "by_zero_mm": 0.03,
        "bz_zero_mm": -0.04,
    },
    "right": {
        "principal_distance_mm": -0.03,
        "principal_point_um": [-20.0, 5.0],
        "omega_zero_gon": 0.015,
        "phi_zero_gon": -0.02,
        "kappa_zero_gon": -0.04,
        "by_zero_mm": -0.02,
        "bz_zero_mm": 0.05,
    },
}


def readings_of(elements, levels=LEVELS, noise=0.0, batch=1, seed=0):
    """Return places ``(2, k, n, batch)`` of the mark at the crosses, with an error of `noise` mm at photo scale."""
    rng = np.random.default_rng(seed)
    centre = np.array([elements["bx"], -elements["by"], elements["bz"]])[:, None, None]
    turned = rotation(*(elements[name] for name in ANGLES))[:, :, None, None]
    seen = CROSSES[:, None, :, None] - np.array([elements["x0"], elements["y0"]])[:, None, None, None]
    seen = seen + noise * rng.standard_normal((2, len(levels), CROSSES.shape[1], batch))
    return np.stack(
        [at_level(centre, ray_of(seen[:, i], turned, elements["c"]), z)[:2] for i, z in enumerate(levels)], axis=1
    )


def faultless(c=152.68):
    return dict.fromkeys(UNKNOWNS, 0.0) | {"c": c}


def as_toml(faults):
    return "{" + ", ".join(f"{name} = {value}" for name, value in faults.items()) + "}"


def with_faults(**overrides):
    faults = {f"instrument.condition.{side}": as_toml(each) for side, each in FAULTS.items()}
    return load_scenario("akwanga", faults | overrides)


def sheets_of(scenario, seed=1, **order):
    document = run_grid_test(scenario, seed, GridTestPlan(scenario.camera, scenario.grid_plate, **order))
    assert document["message"] == ""
    return document["projectors"]


def sheets_of_batch(scenario, seeds, **order):
    """Return the sheets of the left and the right projector, each of a batch of sessions."""
    order = GridTestPlan(scenario.camera, scenario.grid_plate, **order)
    workstation = open_batch(scenario, seeds).workstation
    sheets = list(measure_grid_batch(Workstation(workstation.operators, workstation.driver, order.job), order))
    assert all(len(sheet.sessions) == len(seeds) for sheet in sheets)
    return sheets


# --- the reduction ------------------------------------------------------------------------------------


@examples(40)
@given(
    st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9),
    st.floats(100.0, 210.0),
    st.lists(st.floats(-480.0, -150.0), min_size=2, max_size=4, unique=True).filter(lambda z: max(z) - min(z) > 50.0),
)
def test_exact_readings_return_the_faults(shares, c, levels):
    off = dict(zip(UNKNOWNS, np.array(shares) * [0.5, 0.5, 0.5, 0.02, 0.02, 0.02, 1.0, 1.0, 1.0], strict=True))
    real = {name: value + (c if name == "c" else 0.0) for name, value in off.items()}
    found = grid_test(CROSSES, readings_of(real, levels)[..., 0], levels, Elements(c))
    assert found.s0 < 1e-9
    assert {name: float(error) for name, error in found.errors.items()} == pytest.approx(off, abs=1e-6)


def test_a_projector_that_agrees_with_its_counters_is_tested_in_one_round():
    found = grid_test(CROSSES, readings_of(faultless())[..., 0], LEVELS, Elements(152.68))
    assert found.iterations == 1


def test_s0_equals_the_simulated_pointing_error_and_the_sigmas_equal_the_scatter():
    found = grid_test(CROSSES, readings_of(faultless(), noise=0.005, batch=400), LEVELS, Elements(152.68))
    assert np.sqrt((found.s0**2).mean()) == pytest.approx(0.005, rel=0.02)
    for name in UNKNOWNS:
        assert found.errors[name].std() == pytest.approx(found.sigmas[name].mean(), rel=0.12)
        assert abs(found.errors[name].mean()) < 4.0 * found.sigmas[name].mean() / 20.0


def test_a_tested_principal_point_and_distance_are_known_to_a_hundredth_or_two():
    """geometry.md: c and principal point within 0.01 to 0.02 mm, at s0 4 to 7 um."""
    found = grid_test(CROSSES, readings_of(faultless(), noise=0.006, batch=50), LEVELS, Elements(152.68))
    for name in ("c", "x0", "y0"):
        assert 2.0 * found.sigmas[name].mean() < 0.02


def test_one_level_confuses_a_shift_of_the_centre_with_a_shift_of_the_principal_point():
    off = faultless() | {"bx": 0.03, "by": -0.02, "bz": 0.04}
    found = grid_test(CROSSES, readings_of(off, [-300.0])[..., 0], [-300.0], Elements(152.68))
    assert set(found.errors) == set(UNKNOWNS) - set(HELD_AT_ONE_LEVEL)
    scale = 152.68 / 300.0
    assert found.errors["x0"] == pytest.approx(-scale * 0.03, abs=1e-5)
    assert found.errors["y0"] == pytest.approx(scale * -0.02, abs=1e-5)
    assert found.errors["c"] == pytest.approx(-scale * 0.04, abs=1e-5)
    assert found.errors["phi"] == pytest.approx(0.0, abs=1e-9)


def test_levels_close_together_separate_the_unknowns_less():
    wide, close = (
        grid_test(CROSSES, readings_of(faultless(), z, noise=0.004, batch=20), z, Elements(152.68))
        for z in (LEVELS, (-300.0, -310.0))
    )
    assert close.adjustment.condition.min() > 50.0 * wide.adjustment.condition.max()
    assert abs(close.adjustment.correlations[0, 8]).min() > 0.99
    for name in ("c", "x0", "y0", *HELD_AT_ONE_LEVEL):
        assert close.sigmas[name].mean() > 10.0 * wide.sigmas[name].mean()
    assert close.sigmas["kappa"].mean() < 1.5 * wide.sigmas["kappa"].mean()


def test_undetermined_unknowns_raise_an_error():
    readings = readings_of(faultless())[..., 0]
    with pytest.raises(Undetermined, match="5 crosses or more"):
        grid_test(CROSSES[:, :4], readings[:, :, :4], LEVELS, Elements(152.68))
    with pytest.raises(Undetermined):
        grid_test(CROSSES, readings[:, [0, 0]], [LEVELS[0], LEVELS[0]], Elements(152.68))
    with pytest.raises(Undetermined):
        grid_test(CROSSES[:, :5], readings[:, :, :5], LEVELS, Elements(152.68))


def test_the_placement_of_the_plate_is_subtracted_and_its_uncertainty_added():
    marks = np.array([[-106.0, 106.0, -106.0, 106.0], [-106.0, 106.0, 106.0, -106.0]])
    turn, shift = 3e-4, np.array([0.012, -0.007])
    lain = shift[:, None] + turn * np.array([-marks[1], marks[0]])
    lie = plate_placement(lain + 0.01 * np.random.default_rng(3).standard_normal(lain.shape), marks)
    exact = plate_placement(lain, marks)
    assert (exact.dx, exact.dy, exact.turn) == pytest.approx((*shift, turn))
    assert 0.001 < lie.sigma_shift < 0.015
    without, with_it = (
        grid_test(exact.placed(CROSSES), readings_of(faultless(), noise=0.004)[..., 0], LEVELS, Elements(152.68), of)
        for of in (None, lie)
    )
    assert with_it.sigmas["x0"] == pytest.approx(np.hypot(without.sigmas["x0"], lie.sigma_shift), rel=1e-3)
    assert with_it.errors["x0"] - without.errors["x0"] == pytest.approx(lie.dx, abs=1e-4)
    assert with_it.sigmas["bx"] == pytest.approx(without.sigmas["bx"], rel=1e-3)


# --- the plate ----------------------------------------------------------------------------------------


def test_a_plate_is_ruled_to_its_accuracy_and_does_not_depend_on_the_flight():
    scenes = [build_scene(load_scenario(name), 5) for name in ("akwanga", "dewitt-pair")]
    plates = [scene.grid_plate for scene in scenes]
    assert (plates[0].points.xy == plates[1].points.xy).all()
    assert plates[0].points.names[0] == "G11"
    nominal = np.array(list(GridPlate().crosses.values())).T
    assert np.sqrt(((plates[0].points.xy - nominal) ** 2).mean()) == pytest.approx(0.001, rel=0.2)
    assert "grid" not in scenes[0].photographs


def test_a_plate_is_loaded_over_the_link_like_a_picture():
    scenario = load_scenario("akwanga")
    client = EngineClient(SharedInstrument(build_autograph(scenario.instrument, build_scene(scenario, 1).mountable, 1)))
    assert client.query("PHOT:CAT?") == '"101","102","103","grid"'
    assert client.query('PHOT1:LOAD "grid";:PROJ1:PDIS 152.68;:DRIV:X 0;Y 0;:PHOT1?') == '"grid"'
    assert all(abs(each) < 2000.0 for each in client.numbers('EYEP1? "G55"'))
    assert client.query("PHOT1:FID?").count('"') == 8
    assert client.query('PHOT2:LOAD "grid";:PHOT2?') == '""'
    assert client.errors() == [-221]


@pytest.mark.parametrize(
    ("overrides", "says"),
    [
        ({"grid_plate.lines": "23"}, "grid_plate.spacing_mm: expected crosses within 110 mm"),
        ({"grid_plate.name": '"101"'}, "photos[0].name: expected another name than that of the grid plate"),
        ({"plan.centre_levels": "[4900.0]"}, "plan.centre_levels: expected 2 to 10 counter readings, got 1"),
        ({"plan.centre_levels": "[1.0, 2.0, 3.0]"}, "expected two levels, got 3 (centre_method = 'levels' takes more)"),
        (
            {"plan.centre_method": '"levels"', "plan.centre_levels": "[5100.0, 4900.0, 4900.5]"},
            "expected levels 1 or more apart, got 4900 and 4900.5",
        ),
    ],
)
def test_an_error_message_names_a_plate_or_levels_that_do_not_fit(overrides, says):
    with pytest.raises(ScenarioError) as caught:
        load_scenario("akwanga", overrides)
    assert says in str(caught.value)


def test_crosses_are_selected_evenly():
    plate = GridPlate()
    assert plate.even_counts == [9, 25, 81]
    assert list(plate.some_crosses(9)) == ["G11", "G15", "G19", "G51", "G55", "G59", "G91", "G95", "G99"]
    assert plate.some_crosses(25)["G37"] == (50.0, -50.0)
    assert list(GridPlate(lines=23, spacing_mm=10.0).crosses)[:2] == ["G0101", "G0102"]
    with pytest.raises(A7SimError, match=r"\(9, 25, 81\), got 24"):
        plate.some_crosses(24)


@pytest.mark.parametrize("c", [98.0, 152.68, 215.0])
@pytest.mark.parametrize("levels", [1, 2, 5])
def test_levels_are_within_reach_and_far_apart(c, levels):
    heights = level_heights(VARIANTS["A7"], c, 100.0, levels)
    assert len(heights) == levels
    assert all(-490.0 < z < -140.0 and -z * 100.0 / c < 280.0 for z in heights)
    assert heights == sorted(heights, reverse=True)
    assert levels == 1 or heights[-1] < 1.5 * heights[0]


# --- the operator -------------------------------------------------------------------------------------


def test_without_errors_a_faultless_instrument_has_none():
    """The rest is the rounding of counters to 0.01, on few different coordinates, and the 1 um of the plate."""
    for projector in sheets_of(without_errors(load_scenario("akwanga"))).values():
        assert projector["s0_um"] < 2.5
        assert projector["pointing_um"] < 0.5
        for name, each in projector["elements"].items():
            assert abs(each["error"]) < {"gon": 0.002, "mm": 0.01}[each["unit"]], name


def test_without_errors_given_faults_are_found():
    for side, projector in sheets_of(without_errors(with_faults())).items():
        put_in = FAULTS[side]
        found = {name: each["error"] for name, each in projector["elements"].items()}
        for name in ("omega", "phi", "kappa"):
            assert found[name] == pytest.approx(put_in[f"{name}_zero_gon"], abs=0.002)
        for name in ("by", "bz"):
            assert found[name] == pytest.approx(put_in[f"{name}_zero_mm"], abs=0.01)
        assert found["c"] == pytest.approx(put_in["principal_distance_mm"], abs=0.01)
        assert [found["x0"], found["y0"]] == pytest.approx([um / 1e3 for um in put_in["principal_point_um"]], abs=0.006)
        truth = projector["truth"]["errors"]
        assert truth["phi"] == pytest.approx(put_in["phi_zero_gon"], abs=1e-5)
        assert truth["bz"] == pytest.approx(put_in["bz_zero_mm"], abs=1e-5)


def test_given_faults_are_found_within_three_sigmas():
    scenario = with_faults()
    shares = [
        (sheet.test.errors[name] - truth * (GON if name in ANGLES else 1.0)) / sheet.test.sigmas[name]
        for sheet, at_the_line in zip(sheets_of_batch(scenario, range(8)), sheets_of(scenario).values(), strict=True)
        for name, truth in at_the_line["truth"]["errors"].items()
    ]
    assert np.mean(np.abs(shares) <= 3.0) >= 0.97
    assert np.abs(shares).max() < 5.0
    assert 0.7 < np.std(shares) < 1.4


@pytest.mark.parametrize("pointings", [1, 4])
def test_s0_equals_the_standard_deviation_of_the_mean_pointing(pointings):
    """The pointing error over the root of their number includes the 1 um of the plate and counters read to 0.01."""
    scenario = load_scenario("akwanga", {"observer.monocular_um": "6", "observer.blunder_rate": "0"})
    sheets = sheets_of_batch(scenario, range(4), pointings=pointings)
    s0 = 1e3 * np.sqrt(np.mean([sheet.test.s0**2 for sheet in sheets]))
    assert s0 == pytest.approx(np.sqrt(36.0 / pointings + 1.0 + 3.0 / pointings), rel=0.08)
    if pointings > 1:
        assert 1e3 * np.mean([sheet.pointing for sheet in sheets]) == pytest.approx(6.2, rel=0.06)
    else:
        assert all(np.isnan(sheet.pointing).all() for sheet in sheets)


def test_a_serviced_instrument_gives_four_to_seven_um():
    scenario = load_scenario("grid-test")
    s0 = 1e3 * np.array([sheet.test.s0 for sheet in sheets_of_batch(scenario, range(5))])
    assert 4.0 < s0.min() <= s0.max() < 7.0


def test_slips_are_struck_out_and_do_not_spoil_the_test():
    scenario = with_faults(**{"observer.blunder_rate": "0.04"})
    session = open_session(scenario, 2)
    sheets = list(measure_grid(session.person, GridTestPlan(scenario.camera, scenario.grid_plate)))
    assert sum(bool(entry.struck) for entry in session.person.book.entries) >= 8
    for sheet, faults in zip(sheets, FAULTS.values(), strict=True):
        assert float(sheet.test.s0[0]) < 0.004
        off = sheet.test.errors["phi"] / GON - faults["phi_zero_gon"]
        assert abs(off[0]) < 3.0 * sheet.test.sigmas["phi"][0] / GON


def test_a_batch_tests_its_instruments_as_each_session_does_over_the_link():
    scenario = with_faults()
    order = GridTestPlan(scenario.camera, scenario.grid_plate)
    batch = open_batch(scenario, [1, 2])
    sheets = list(
        measure_grid_batch(Workstation(batch.workstation.operators, batch.workstation.driver, order.job), order)
    )
    for i, seed in enumerate((1, 2)):
        session = open_session(scenario, seed)
        for sheet, alone in zip(sheets, measure_grid(session.person, order), strict=True):
            assert {name: each[i] for name, each in sheet.test.errors.items()} == pytest.approx(
                {name: each[0] for name, each in alone.test.errors.items()}, abs=1e-9
            )
            assert sheet.finished_at[i] == pytest.approx(alone.finished_at[0])


def test_effects_of_the_carriages_are_separate_in_the_truth():
    """A skew of XZ acts like a principal point, scales act like another principal distance."""
    scenario = without_errors(
        load_scenario(
            "akwanga",
            {
                "instrument.condition.carriage_scale_ppm": "[100.0, 100.0, -50.0]",
                "instrument.condition.carriage_skew_ppm": "[60.0, 120.0, -90.0]",
            },
        )
    )
    for projector in sheets_of(scenario).values():
        assert projector["truth"]["of_the_carriages"]["c"] == pytest.approx(0.0229, abs=1e-4)
        for name in ("c", "x0", "y0", "kappa"):
            assert abs(projector["truth"]["errors"][name]) > 0.0015
            assert abs(projector["truth"]["differences"][name]) < 0.006


# --- perspective centres ------------------------------------------------------------------------------

METHODS = {
    "two levels": {},
    "levels": {"plan.centre_levels": "[4800.0, 4900.0, 5000.0, 5100.0, 5200.0]"},
    "grid plate": {},
}

SEEDS = range(6)


@cache
def centres_by(method, seed):
    documents, hours = sessions_by(method)
    return {
        (model["model"], side): (
            model["perspective_centres"][side],
            model["truth"]["centre_differences"][side],
            hours[seed],
        )
        for model in documents[seed]["models"]
        for side in ("left", "right")
    }


@cache
def sessions_by(method):
    plan = {"plan.centre_method": f'"{method}"', "plan.parallax_readings": "2"}
    batch = open_batch(load_scenario("akwanga", plan | METHODS[method]), SEEDS)
    documents = batch.run()
    assert batch.workstation.operators.reasons == {}
    return documents, batch.workstation.operators.seconds / 3600.0


@pytest.mark.slow
@pytest.mark.parametrize("method", list(METHODS))
def test_centres_by_every_method_are_within_three_sigmas_of_the_truth(method):
    shares = [
        difference[name] / centre[f"sigma_{name}"]
        for seed in SEEDS
        for centre, difference, _ in centres_by(method, seed).values()
        for name in ("X0", "Y0", "Z0")
    ]
    assert np.mean(np.abs(shares) <= 3.0) >= 0.95
    assert np.abs(shares).max() < 5.0
    assert 0.7 < np.std(shares) < 1.4


@pytest.mark.slow
def test_the_three_methods_agree_within_three_sigmas():
    """Each differs from the truth of its own model; every session sets up its model slightly differently."""
    shares = []
    for one, other in (("two levels", "levels"), ("levels", "grid plate"), ("two levels", "grid plate")):
        for seed in SEEDS:
            for which, (centre, difference, _) in centres_by(one, seed).items():
                beside, its_difference, _ = centres_by(other, seed)[which]
                for name in ("X0", "Y0", "Z0"):
                    sigma = np.hypot(centre[f"sigma_{name}"], beside[f"sigma_{name}"])
                    shares.append((difference[name] - its_difference[name]) / sigma)
    assert np.mean(np.abs(shares) <= 3.0) >= 0.95
    assert 0.7 < np.std(shares) < 1.4


@pytest.mark.slow
def test_levels_and_plate_are_more_exact_and_take_longer():
    def typical(method, what):
        return np.median([what(each) for seed in SEEDS for each in centres_by(method, seed).values()])

    for name in ("sigma_X0", "sigma_Z0"):
        two, more, plate = (typical(method, lambda each, name=name: each[0][name]) for method in METHODS)
        assert more < 0.7 * two
        assert plate < 0.8 * two
    two, more, plate = (typical(method, lambda each: each[2]) for method in METHODS)
    assert two < more
    assert two < plate


@pytest.mark.parametrize(
    "levels", [(4900.0, 5100.0), (4900.0, 4950.0, 5000.0, 5050.0, 5100.0), tuple(np.linspace(4900.0, 5100.0, 9))]
)
def test_more_levels_make_the_centre_more_exact_as_in_theory(levels):
    """Height comes from the slopes of the lines, with the variance of a pointing over the squares of the levels."""
    rng = np.random.default_rng(8)
    z0, n, batch, sigma = 7573.0, 6, 3000, 0.008
    at = np.array([[-0.1, 1.1, -0.1, 1.1, -0.1, 1.1], [0.0, 0.0, 1.1, 1.1, -1.1, -1.1]]) * 0.0585
    depth = z0 - np.array(levels)
    pointings = (at[:, None] * depth[:, None])[..., None] + sigma * rng.standard_normal((2, len(levels), n, batch))
    found = perspective_centre_of_levels(pointings, levels)
    off = np.array(levels) - np.mean(levels)
    about = at - at.mean(axis=1, keepdims=True)
    of_slope = sigma / np.sqrt((off @ off) * (about**2).sum())
    expected = of_slope * depth.mean()
    assert found.Z0.std() == pytest.approx(expected, rel=0.06)
    assert found.sigma_Z0.mean() == pytest.approx(found.Z0.std(), rel=0.12)


def test_the_picture_is_mounted_and_centred_again_after_the_test():
    session = open_session(read_once(load_scenario("akwanga", {"plan.centre_method": '"grid plate"'})), 1)
    record = next(iter(measure_models(session.person, session.job)))
    elements = {name: session.autograph.element(name) for name in record.orientation.elements}
    assert elements == dict(record.orientation.elements)
    assert (session.autograph.loaded(1), session.autograph.loaded(2)) == ("101", "102")
    for projector in (1, 2):
        for _, dx, dy in session.autograph.carrier(projector).fiducial_displacements():
            assert abs(dx) < 0.1
            assert abs(dy) < 0.1


def test_a_plate_with_too_few_crosses_in_the_model_does_not_pass():
    scenario = read_once(
        load_scenario(
            "akwanga",
            {"plan.centre_method": '"grid plate"', "grid_plate.lines": "3", "grid_plate.spacing_mm": "100.0"},
        )
    )
    document = run(scenario, 1)
    assert document["status"] == "does not fit"
    assert "too few crosses of plate grid lie within the model" in document["message"]


# --- the command --------------------------------------------------------------------------------------


def a7sim(*arguments):
    return a7sim_in_process(*arguments, cwd=ROOT)


def test_calibrate_writes_a_sheet(tmp_path):
    out = tmp_path / "sheet"
    done = a7sim("calibrate", "akwanga", "--points", 25, "--json", "--out", out)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert {path.name for path in out.iterdir()} == {
        "session.jsonl",
        "session.scenario.json",
        "session.states.jsonl",
        "book.csv",
        "residuals.csv",
        "results.json",
    }
    assert document == json.loads((out / "results.json").read_text(encoding="utf-8"))
    assert list(document)[:2] == ["schema_version", "command"]
    assert document["command"] == "calibrate"
    for side in ("left", "right"):
        projector = document["projectors"][side]
        assert list(projector["elements"]) == list(UNKNOWNS)
        assert projector["elements"]["c"]["counter"] == 152.68
        assert set(projector["truth"]["errors"]) == set(UNKNOWNS)
        assert len(projector["residuals_um"]) == 25
        assert projector["largest_residual"]["um"] >= projector["s0_um"]
        assert len(projector["statistics"]["correlations"]) == len(UNKNOWNS)
    with (out / "residuals.csv").open(encoding="utf-8") as file:
        assert len(list(csv.reader(file))) == 1 + 2 * 2 * 25
    assert "truth" not in (out / "session.jsonl").read_text(encoding="utf-8")
    assert a7sim("calibrate", "akwanga", "--out", out).returncode == 2


def test_calibrate_prints_the_sheet_of_a_service_engineer():
    printed = a7sim("calibrate", "akwanga", "--levels", 1, "--points", 9)
    assert printed.returncode == 0, printed.stderr
    words = " ".join(printed.stdout.split())
    for each in (
        "Grid test of Wild A7 no. 3268",
        "9 crosses of plate grid at Z 312.5 mm below the centre, 2 pointings each",
        "left projector",
        "right projector",
        "µm at photo scale",
        "held, because one level does not separate them from c, x0 and y0: bx, by, bz",
    ):
        assert each in words


def test_the_centres_of_an_a8_refer_to_the_middle_of_the_base():
    """An A8 has no counters for by and bz, but the test finds them; X and Y count 2 mm."""
    document = json.loads(a7sim("calibrate", "akwanga-a8", "--seed", 4, "--json").stdout)
    assert document["variant"] == "A8"
    for side in ("left", "right"):
        projector = document["projectors"][side]
        assert {name for name, each in projector["elements"].items() if "counter" not in each} == {
            "x0",
            "y0",
            "by",
            "bz",
        }
        for name, off in projector["truth"]["differences"].items():
            assert abs(off) < 4.0 * projector["elements"][name]["sigma"], (side, name)


def test_two_tests_of_the_same_seed_are_equal():
    one, other = (a7sim("calibrate", "grid-test", "--seed", 4, "--json", "--points", 9).stdout for _ in range(2))
    assert one == other


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            ["akwanga", "--points", "24"],
            "--points: expected a number of crosses that are spaced evenly on the plate (9, 25, 81), got 24",
        ),
        (["nowhere"], "expected a scenario file or one of"),
        (["akwanga", "--set", "grid_plate.lines=2"], "grid_plate.lines: expected 3 to 23 lines each way, got 2"),
    ],
)
def test_wrong_input_gets_one_sentence_and_exit_code_two(arguments, sentence):
    done = a7sim("calibrate", *arguments)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""


def test_an_operator_that_cannot_centre_the_plate_reports_it():
    done = a7sim("calibrate", "akwanga", "--set", "observer.fiducial_um=900", "--quiet")
    assert done.returncode == 1
    assert "picture grid cannot be centred in projector 1" in done.stderr
