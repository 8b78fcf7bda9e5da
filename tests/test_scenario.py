"""Scenario files: every mistake at once with its path, and every story that comes with a7sim told to its end."""

import tomllib
from pathlib import Path

import msgspec
import pytest

from a7sim.files import read_rows
from a7sim.scenario import ScenarioError, load_scenario, scenario_of, scenario_schema
from a7sim.session import run

SCENARIOS = sorted((Path(__file__).parents[1] / "scenarios").glob("*.toml"))


def akwanga():
    return tomllib.loads(next(p for p in SCENARIOS if p.stem == "akwanga").read_text(encoding="utf-8"))


def mistakes_of(raw):
    with pytest.raises(ScenarioError) as caught:
        scenario_of(raw, SCENARIOS[0].parent, "test")
    return caught.value.mistakes


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_every_scenario_runs_to_its_end(path):
    document = run(load_scenario(path), 1)
    assert document["status"] == "complete", document["message"]
    assert len(document["models"]) == len(load_scenario(path).models)


def test_every_mistake_is_named_at_once_with_its_path():
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
        "sed: unknown key; did you mean seed?",
        'title: expected a text of 1 to 64 characters, got ""',
        'camera.c: expected a principal distance of 98 to 215 mm, got "long"',
        "camera.fiducials[2].x: expected mm within the 230 mm format, got 412",
        "film.irregular_um: expected a standard deviation, zero or more, got -1",
        "photos[1].position: expected a list of 3 numbers, got a list of 2",
        "photos[2].kapa: unknown key; did you mean kappa?",
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
            "models[0].standard_points: expected all of the positions 1 to 6",
        ),
        (lambda raw: raw["plan"].update(height_gear="Xy"), "plan.height_gear: expected counter units a mm"),
        (lambda raw: raw.update(schema_version=2), "schema_version: expected 1, got 2"),
        (
            lambda raw: raw["instrument"]["condition"].update(left=1),
            "instrument.condition.left: expected a table, got 1",
        ),
    ],
)
def test_a_mistake_of_each_kind_is_one_sentence(change, mistake):
    raw = akwanga() | {"air": {}}
    raw["instrument"]["condition"] = {}
    change(raw)
    found = mistakes_of(raw)
    assert any(each.startswith(mistake) for each in found), found
    assert all("\n" not in each for each in found)


def test_a_file_that_is_not_there_is_named_with_what_there_is():
    with pytest.raises(ScenarioError, match=r"nowhere\.toml: expected a scenario file or one of akwanga, dewitt-pair"):
        load_scenario("nowhere.toml")


def test_broken_toml_is_named_with_its_line(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text('schema_version = 1\ntitle = "x\n', encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"broken\.toml: expected TOML.*line 2"):
        load_scenario(path)


def test_a_measured_file_beside_the_scenario_must_be_there():
    raw = tomllib.loads(next(p for p in SCENARIOS if p.stem == "dewitt-pair").read_text(encoding="utf-8"))
    raw["photos"][0]["measured"]["file"] = "lost.csv"
    assert mistakes_of(raw) == [
        "photos[0].measured.file: expected a file beside the scenario, got 'lost.csv', which is not there"
    ]


def test_overrides_reach_any_value_and_a_wrong_path_is_named():
    scenario = load_scenario("akwanga", {"observer.parallax_um": "2.5", "photos.1.phi": "3", "plan.case": "E"})
    assert (scenario.observer.parallax_um, scenario.photos[1].phi, scenario.plan.case) == (2.5, 3.0, "E")
    with pytest.raises(ScenarioError, match=r"photos\.7\.phi"):
        load_scenario("akwanga", {"photos.7.phi": "3"})
    with pytest.raises(ScenarioError, match=r"plan\.cse: unknown key; did you mean case\?"):
        load_scenario("akwanga", {"plan.cse": "E"})


def test_the_schema_describes_what_the_scenarios_say():
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


def test_akwanga_stands_on_the_numbers_of_the_thesis():
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


def test_the_real_pair_is_reference_03(reference):
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
