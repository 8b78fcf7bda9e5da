"""Scenario files: all mistakes are reported together with their paths, and every shipped scenario runs to its end."""

import tomllib
from pathlib import Path

import msgspec
import pytest

from a7sim.errors import A7SimError
from a7sim.scenario import ScenarioError, build_scenario, load_scenario, scenario_schema
from a7sim.session.all_methods import run_all_methods
from a7sim.table_files import read_rows

SCENARIOS = sorted((Path(__file__).parents[1] / "scenarios").glob("*.toml"))


def akwanga():
    return tomllib.loads(next(p for p in SCENARIOS if p.stem == "akwanga").read_text(encoding="utf-8"))


def a8_strip():
    return tomllib.loads(next(p for p in SCENARIOS if p.stem == "a8-strip").read_text(encoding="utf-8"))


def mistakes_of(raw):
    with pytest.raises(ScenarioError) as caught:
        build_scenario(raw, SCENARIOS[0].parent, "test")
    return caught.value.mistakes


WORKED_ELSEWHERE = {"bridge"}
"""Scenarios that test_bridging_shipped runs, bridged and as independent models."""


@pytest.mark.parametrize("path", [p for p in SCENARIOS if p.stem not in WORKED_ELSEWHERE], ids=lambda path: path.stem)
def test_every_scenario_runs_to_its_end(path):
    scenario = load_scenario(path)
    document = run_all_methods(scenario, 1)
    assert document["status"] == "complete", document["message"]
    assert len(document.get("models", scenario.models)) == len(scenario.models)
    for strip in document.get("ways", {}).values():
        assert len(strip["joins"]) == len(scenario.models) - 1
        assert not strip["warnings"]


def test_all_mistakes_are_reported_together_with_their_paths():
    raw = akwanga()
    raw["sed"] = 3
    raw["title"] = ""
    raw["camera"]["c"] = "long"
    raw["camera"]["fiducials"][2]["x"] = 412
    raw["photos"][1]["position"] = [1.0, 2.0]
    raw["photos"][2]["kapa"] = 1.0
    raw["photos"][0]["name"] = "103"
    raw["models"][0]["right"] = "104"
    del raw["plan"]["bx"]
    raw["plan"]["case"] = "F"
    raw["plan"]["centre_levels"] = [4900.0, 4900.0]
    raw["film"]["irregular_um"] = -1
    assert mistakes_of(raw) == [
        "sed: expected a key that is known; did you mean seed?",
        'title: expected a text of 1 to 64 characters, got ""',
        'camera.c: expected a principal distance of 98 to 215 mm, got "long"',
        "camera.fiducials[2].x: expected mm within the 230 mm format, got 412",
        "film.irregular_um: expected a standard deviation, zero or more, got -1",
        "photos[1].position: expected a list of 3 numbers, got a list of 2",
        "photos[2].kapa: expected a key that is known; did you mean kappa?",
        "plan.case: expected 'A' or 'B' or 'C' or 'D' or 'E', got \"F\"",
        "plan.bx: expected a base of 10 to 280 mm, got nothing",
        "photos[2].name: expected a name of its own, got '103' as in photos[0]",
        "models[0].left: expected a photograph of this scenario (103, 102), got '101'",
        "models[0].right: expected a photograph of this scenario (103, 102), got '104'",
        "plan.centre_levels: expected levels 1 or more apart, got 4900 and 4900",
    ]


@pytest.mark.parametrize(
    ("change", "mistake"),
    [
        (lambda raw: raw["photos"].__setitem__(0, 7), "photos[0]: expected a table, got 7"),
        (lambda raw: raw.update(photos="all"), 'photos: expected two photographs or more, got "all"'),
        (lambda raw: raw.update(camera=3), "camera: expected a table, got 3"),
        (lambda raw: raw["camera"]["fiducials"].pop(), "camera.fiducials: expected four or eight fiducials, got 3"),
        (lambda raw: raw["photos"][0].pop("position"), "photos[0]: expected either a position it was flown from or"),
        (lambda raw: raw["air"].update(refraction=1), "air.refraction: expected true or false, got 1"),
        (lambda raw: raw["models"][0].update(right="101"), "models[0]: expected two photographs, got '101' on both"),
        (
            lambda raw: raw["models"][0].update(standard_points={"7": "x"}),
            "models[0].standard_points: expected a point in each of the three rows",
        ),
        (lambda raw: raw["plan"].update(height_gear="Xy"), "plan.height_gear: expected counter units a mm"),
        (lambda raw: raw.update(schema_version=2), "schema_version: expected 1, got 2"),
        (
            lambda raw: raw["instrument"]["condition"].update(left=1),
            "instrument.condition.left: expected a table, got 1",
        ),
        (
            lambda raw: raw["plan"].update(centre_levels="low"),
            'plan.centre_levels: expected 2 to 10 counter readings, got "low"',
        ),
        (
            lambda raw: raw["plan"].update(centre_levels=[4900.0, 5000.0, 5100.0]),
            "plan.centre_levels: expected two levels, got 3 (centre_method = 'levels' takes more)",
        ),
        (
            lambda raw: raw["camera"]["fiducials"].append({"name": "5", "x": 0.0, "y": 106.0}),
            "camera.fiducials: expected four or eight fiducials, got 5",
        ),
        (
            lambda raw: raw["photos"][0].update(measured={"file": "pair.csv"}),
            "photos[0]: expected either a position it was flown from or a measured file, got both",
        ),
        (
            lambda raw: raw["photos"][0].update(measured={"side": "left", "photo": "101"}),
            "photos[0].measured: expected either a side of a pair file or a photo of a photo file, got both",
        ),
        (
            lambda raw: raw["photos"][0].update(measured={"count_mm": 0.001}),
            "photos[0].measured.count_mm: expected units = 'counts' beside it, got 'mm'",
        ),
        (
            lambda raw: raw["photos"][0].update(position=[440728.0, 985010.0, 480.0]),
            "photos[0].position[2]: expected a station above the terrain (487.92 m), got 480",
        ),
        (
            lambda raw: raw["photos"][0].update(polarity="negative"),
            "models[0]: expected two positives or two negatives, got one of each",
        ),
        (
            lambda raw: raw["photos"][1].update(position=raw["photos"][0]["position"]),
            "models[0]: expected two stations apart, got both photographs from [",
        ),
        (
            lambda raw: raw["models"][0].update(published={"base": [0.0, 0.0, 0.0]}),
            "models[0].published.base: expected a vector, got zero",
        ),
        (
            lambda raw: raw["models"][0].update(standard_points={"7": "x"}),
            "models[0].standard_points.7: expected a position 1 to 6 or a to i, got '7'",
        ),
        (
            lambda raw: raw["models"][0].update(standard_points={"1": "x", "2": "x"}),
            "models[0].standard_points.1: expected a point of its own, got 'x' at 2 positions",
        ),
        (
            lambda raw: raw.update(grid_plate={"spacing_mm": 30.0, "lines": 9}),
            "grid_plate.spacing_mm: expected crosses within 110 mm of the middle, got 120 mm",
        ),
        (
            lambda raw: raw.update(grid_plate={"name": "101"}),
            "photos[0].name: expected another name than that of the grid plate, got '101'",
        ),
        (
            lambda raw: raw.update(work=["bridge"], models=raw["models"][:1]),
            "models: expected base inside and outside in turn, as bridging needs, got one of them alone",
        ),
    ],
)
def test_the_error_message_for_each_kind_of_mistake_is_one_sentence(change, mistake):
    raw = akwanga() | {"air": {}}
    raw["instrument"]["condition"] = {}
    change(raw)
    found = mistakes_of(raw)
    assert any(each.startswith(mistake) for each in found), found
    assert all("\n" not in each for each in found)


@pytest.mark.parametrize(
    ("change", "mistakes"),
    [
        (
            lambda raw: raw.update(work=["plotter", "theodolite", "plotter"]),
            [
                "work[1]: expected 'bridge' or 'comparator' or 'plotter' or 'readings', got \"theodolite\"",
                "work[2]: expected every way once, got 'plotter' twice",
            ],
        ),
        (
            lambda raw: raw.update(work=[]),
            ["work: expected 'plotter', 'comparator', 'readings' or 'bridge', or several, got 0"],
        ),
        (
            lambda raw: raw.pop("plan"),
            ["plan: expected the settings of the plotter, got nothing (work = ['comparator'] needs none)"],
        ),
        (
            lambda raw: raw["comparator"].update(kind="quadro", pointings=0, least_count_um=-1),
            [
                "comparator.kind: expected 'mono' or 'stereo', got \"quadro\"",
                "comparator.pointings: expected 1 to 20 pointings, got 0",
                "comparator.least_count_um: expected micrometres, 0 (not rounded) to 100, got -1",
            ],
        ),
        (
            lambda raw: raw["strip"].update(polynomial=4, join="glue"),
            [
                "strip.join: expected 'centre' or 'heights' or 'points', got \"glue\"",
                "strip.polynomial: expected 2 or 3, got 4",
            ],
        ),
        (
            lambda raw: raw.update(ground=raw["ground"][:4]),
            ["strip.polynomial: expected 3 points of ground control in plan and 5 in height for degree 2, got 4 and 4"],
        ),
        (
            lambda raw: raw.update(ground=[], strip={}),
            ["ground: expected 2 points of control in plan and 3 in height for a strip by comparator, got 0 and 0"],
        ),
        (
            lambda raw: raw["plan"].update(method="dependent"),
            ["plan.method: expected 'independent' on an A8, which has neither by nor bz, got 'dependent'"],
        ),
        (
            lambda raw: raw.update(models=[{"name": "1", "left": "201", "right": "202", "base": "outside"}]),
            ["models[0].base: expected 'inside', all that an A8 has, got 'outside'"],
        ),
        (
            lambda raw: raw["instrument"].update(variant="A7", grid_test={"local": "rough"}),
            [
                "instrument.grid_test.local: expected 'scattered' or 'smooth', got \"rough\"",
                "instrument.grid_test: expected variant = 'A8' beside it; the faults of an A7 stand in condition",
            ],
        ),
    ],
)
def test_mistakes_in_the_methods_of_a_strip_are_reported(change, mistakes):
    raw = a8_strip()
    change(raw)
    assert mistakes_of(raw) == mistakes


def test_without_models_every_photograph_is_paired_with_the_next():
    scenario = load_scenario("schut-1956")
    assert [(model.name, model.left, model.right) for model in scenario.models][::9] == [
        ("1", "1", "2"),
        ("10", "10", "11"),
    ]


def test_a_scenario_with_only_the_comparator_has_no_plan():
    scenario = load_scenario("schut-1956")
    assert scenario.work == ["comparator"]
    assert scenario.half_width == 85.0
    with pytest.raises(A7SimError, match="the scenario is not for one"):
        _ = scenario.plan


def test_the_error_message_for_a_missing_file_names_the_existing_scenarios():
    with pytest.raises(ScenarioError, match=r"nowhere\.toml: expected a scenario file or one of a8-strip, akwanga, "):
        load_scenario("nowhere.toml")


def test_the_error_message_for_a_folder_does_not_call_it_missing(tmp_path):
    with pytest.raises(ScenarioError, match=r"expected a scenario file .*, found a folder"):
        load_scenario(tmp_path)


def test_the_error_message_for_broken_toml_names_the_line(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text('schema_version = 1\ntitle = "x\n', encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"broken\.toml: expected TOML.*line 2"):
        load_scenario(path)


def test_a_measured_file_of_a_scenario_must_exist():
    raw = tomllib.loads(next(p for p in SCENARIOS if p.stem == "dewitt-pair").read_text(encoding="utf-8"))
    raw["photos"][0]["measured"]["file"] = "lost.csv"
    assert mistakes_of(raw) == [
        "photos[0].measured.file: expected a file beside the scenario, got 'lost.csv', which is not there"
    ]


def test_overrides_can_set_any_value_and_a_wrong_path_is_reported():
    scenario = load_scenario("akwanga", {"observer.parallax_um": "2.5", "photos.1.phi": "3", "plan.case": "E"})
    assert (scenario.observer.parallax_um, scenario.photos[1].phi, scenario.plan.case) == (2.5, 3.0, "E")
    with pytest.raises(ScenarioError, match=r"photos\.7\.phi"):
        load_scenario("akwanga", {"photos.7.phi": "3"})
    with pytest.raises(ScenarioError, match=r"plan\.cse: expected a key that is known; did you mean case\?"):
        load_scenario("akwanga", {"plan.cse": "E"})


def test_the_schema_describes_the_keys_of_the_scenarios():
    schema = scenario_schema()
    described = schema["$defs"]["Scenario"]["properties"]
    for path in SCENARIOS:
        assert set(tomllib.loads(path.read_text(encoding="utf-8"))) <= set(described)
    assert schema["$defs"]["Fiducial"]["properties"]["x"] == {
        "type": "number",
        "minimum": -115,
        "maximum": 115,
        "description": "mm within the 230 mm format",
    }
    assert msgspec.json.encode(schema)


def test_akwanga_has_the_numbers_of_the_thesis():
    scenario = load_scenario("akwanga")
    assert scenario.camera.c == 152.676
    assert scenario.plan.bx == 194.99
    assert scenario.plan.projection_height == 325.709
    assert scenario.terrain.mean_height == 459.08
    assert scenario.terrain.relief == 28.84
    heights = [photo.position[2] - scenario.terrain.mean_height for photo in scenario.photos]
    assert all(1192.568 <= height <= 1250.248 for height in heights)
    bases = [b.position[0] - a.position[0] for a, b in zip(scenario.photos, scenario.photos[1:], strict=False)]
    assert [abs(base) / 8000.0 * 1000.0 for base in bases] == pytest.approx([91.0, 90.75], abs=0.3)


def test_the_real_pair_equals_reference_03(reference):
    published = tomllib.loads((reference / "03_dewitt_public_domain.toml").read_text(encoding="utf-8"))
    expected = published["relative_orientation"]
    scenario = load_scenario("dewitt-pair")
    of_model = scenario.models[0].published
    degrees = [angle * 0.9 for angle in (of_model.omega, of_model.phi, of_model.kappa)]
    assert degrees == pytest.approx(expected["expected_omega_phi_kappa_deg"], abs=1e-4)
    assert of_model.base == tuple(expected["expected_base_mm"])
    sigmas = [sigma * 0.9 for sigma in (of_model.sigma_omega, of_model.sigma_phi, of_model.sigma_kappa)]
    assert sigmas == pytest.approx(expected["expected_sd_deg"], abs=1e-5)
    assert scenario.camera.c == expected["c_mm"]
    path = next(p for p in SCENARIOS if p.stem == "dewitt-pair").with_suffix(".csv")
    rows = {row.texts["point"]: row.numbers for row in read_rows(path, ["point"], ["xl", "yl", "xr", "yr"])}
    assert rows == {p["id"]: {k: p[k] for k in ("xl", "yl", "xr", "yr")} for p in expected["points"]}
