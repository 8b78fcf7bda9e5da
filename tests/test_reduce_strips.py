"""`a7sim reduce connect|strip|absolute|block`: models to the ground, from any kind of file, in any order."""

import csv
import json
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim import processing
from a7sim.errors import A7SimError
from a7sim.geometry import rotation
from a7sim.processing.strips import PairCamera
from a7sim.reduction.absolute import Ground
from a7sim.reduction.cards import deck_lines, read_cards
from a7sim.reduction.strips import Model
from tests.support.hypothesis_profile import examples
from tests.test_reduce import reduce

C = 152.0
SCALE = 10.0
"""Model mm to ground m."""


def flat_strip(rng, photographs, noise=0.0):
    """Models of a strip with centres, turned and scaled at random, and their ground, in which every second is a check.

    Names are numbers of at most four digits, as cards want them.
    """
    places = {str(100 + 10 * i + k): np.array([90.0 * i, y, 0.0]) + rng.uniform(-4, 4, 3)
              for i in range(photographs) for k, y in enumerate((80.0, 0.0, -80.0, 40.0))}  # fmt: skip
    centres = {f"{i + 1}:centre": np.array([90.0 * i, 0.0, 150.0]) for i in range(photographs)}
    models = []
    for i in range(photographs - 1):
        names = [name for name in places if (int(name) - 100) // 10 in (i, i + 1)]
        names += [f"{i + 1}:centre", f"{i + 2}:centre"]
        true = np.array([{**places, **centres}[name] for name in names]).T
        turn = rotation(*rng.uniform(-0.05, 0.05, 3))
        local = rng.uniform(0.9, 1.1) * turn @ true + rng.uniform(-9, 9, (3, 1))
        models.append(Model(str(i + 1), tuple(names), local + noise * rng.standard_normal(local.shape)))
    names = tuple(places)
    ground = np.array([places[name] * SCALE + (700.0, 500.0, 90.0) for name in names]).T
    return models, Ground(names, ground, tuple("control" if name[-1] in "02" else "check" for name in names))


def models_file(path, models, shuffle=None):
    rows = [[m.name, name, *place] for m in models for name, place in zip(m.points, m.coordinates.T, strict=True)]
    order = range(len(rows)) if shuffle is None else shuffle.permutation(len(rows))
    lines = [",".join(map(str, rows[i])) for i in order]
    path.write_text("model,point,X,Y,Z\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def ground_file(path, ground, shuffle=None):
    order = range(len(ground.points)) if shuffle is None else shuffle.permutation(len(ground.points))
    lines = [f"{ground.points[i]},{','.join(map(str, ground.coordinates[:, i]))},{ground.roles[i]}" for i in order]
    path.write_text("point,X,Y,Z,role\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def pairs_file(path, rng, photographs, shuffle=None):
    """Image coordinates of a strip of tilted photographs, models named LEFT-RIGHT, with 5 um of noise."""
    _, ground = flat_strip(rng, photographs)
    images = {}
    for i in range(photographs):
        turn, centre = rotation(*rng.uniform(-0.03, 0.03, 3)), np.array([900.0 * i + 700.0, 500.0, 1610.0])
        for name, place in zip(ground.points, ground.coordinates.T, strict=True):
            x, y, z = turn.T @ (place - centre)
            if abs(x) < -z * 0.75:
                images[i, name] = C * np.array([x, y]) / -z + 0.005 * rng.standard_normal(2)
    rows = [
        f"{i + 1}-{j + 1},{name},{','.join(map(str, (*images[i, name], *images[j, name])))}"
        for i, j in pairwise(range(photographs))
        for name in ground.points
        if (i, name) in images and (j, name) in images
    ]
    rows = rows if shuffle is None else [rows[k] for k in shuffle.permutation(len(rows))]
    path.write_text("model,point,xl,yl,xr,yr\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path, ground


def largest_difference(one, other):
    """The largest difference between two documents' results, by key."""
    assert one["points"].keys() == other["points"].keys()
    assert [join["models"] for join in one["joins"]] == [join["models"] for join in other["joins"]]
    differences = [np.array(one["points"][p]) - other["points"][p] for p in one["points"]]
    differences += [np.array(a["scale"]) - b["scale"] for a, b in zip(one["joins"], other["joins"], strict=True)]
    return max(np.abs(each).max() for each in differences)


@examples(15)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["points", "centre", "heights"]))
def test_the_order_of_rows_and_models_changes_nothing(tmp_path_factory, seed, method):
    rng, shuffle = np.random.default_rng(seed), np.random.default_rng(seed + 1)
    models, ground = flat_strip(rng, int(rng.integers(3, 6)), noise=0.02)
    folder = tmp_path_factory.mktemp("order")
    documents = [
        processing.strip(
            models_file(folder / "m.csv", models, order), ground_file(folder / "g.csv", ground, order), method=method
        ).document
        for order in (None, shuffle)
    ]
    assert largest_difference(*documents) < 1e-9


@examples(10)
@given(st.integers(0, 2**32 - 1))
def test_the_order_of_pairs_and_photographs_changes_nothing(tmp_path_factory, seed):
    folder = tmp_path_factory.mktemp("order")
    documents = []
    for shuffle in (None, np.random.default_rng(seed + 1)):
        path, ground = pairs_file(folder / "p.csv", np.random.default_rng(seed), 4, shuffle)
        known = ground_file(folder / "g.csv", ground, shuffle)
        documents.append(processing.strip(path, known, PairCamera(C), degree=2).document)
    assert largest_difference(*documents) < 1e-9
    assert documents[0] == documents[1]


@examples(10)
@given(st.integers(0, 2**32 - 1))
def test_the_order_of_cards_changes_nothing(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    models, ground = flat_strip(rng, int(rng.integers(3, 6)), noise=0.02)
    lines = deck_lines(ground, models)
    starts = [i for i, line in enumerate(lines) if line in ("  -1", "  -2")]
    sections = [lines[i:j] for i, j in pairwise([0, *starts, len(lines)])]
    control, alone, ties = sections[0], sections[1], sections[2:]

    def mixed(cards, fixed):
        return cards[:fixed] + [cards[fixed + i] for i in rng.permutation(len(cards) - fixed)]

    pairs = [(mixed(a, 2), mixed(b, 2)) for a, b in zip(ties[::2], ties[1::2], strict=True)]
    shuffled = mixed(control, 0) + mixed(alone, 1)
    shuffled += [line for i in rng.permutation(len(pairs)) for half in pairs[i] for line in half]
    path = tmp_path_factory.mktemp("cards") / "strip.crd"
    documents = []
    for each in (lines, shuffled):
        path.write_text("".join(f"{line}\n" for line in each), encoding="ascii")
        documents.append(processing.strip(path).document)
    assert largest_difference(*documents) < 1e-9


@examples(10)
@given(st.integers(0, 2**32 - 1))
def test_a_strip_without_errors_is_recovered_exactly(tmp_path_factory, seed):
    models, ground = flat_strip(np.random.default_rng(seed), 4)
    folder = tmp_path_factory.mktemp("exact")
    document = processing.strip(models_file(folder / "m.csv", models), ground_file(folder / "g.csv", ground)).document
    for name, place in zip(ground.points, ground.coordinates.T, strict=True):
        np.testing.assert_allclose(document["points"][name], place, rtol=1e-9)


def test_cards_and_models_of_one_strip_agree_to_the_digits_of_the_cards(tmp_path):
    models, ground = flat_strip(np.random.default_rng(1), 4)
    (tmp_path / "deck").write_text("".join(f"{line}\n" for line in deck_lines(ground, models)), encoding="ascii")
    from_cards = processing.strip(tmp_path / "deck").document
    known = ground_file(tmp_path / "g.csv", ground)
    from_models = processing.strip(models_file(tmp_path / "m.csv", models), known).document
    assert [from_cards["input"], from_models["input"]] == ["cards", "models"]
    for name, place in from_cards["points"].items():
        np.testing.assert_allclose(place, from_models["points"][name], atol=0.05)
    with_checks = processing.strip(tmp_path / "deck", known).document
    assert with_checks["accuracy_m"]["checks"]["points"] == 8


def test_a_strip_in_toml_is_the_strip_in_csv(tmp_path):
    models, ground = flat_strip(np.random.default_rng(2), 3, noise=0.02)
    path, known = models_file(tmp_path / "m.csv", models), ground_file(tmp_path / "g.csv", ground)
    for each in (path, known):
        with each.open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        tables = [
            "[[rows]]\n" + "".join(f"{k} = {v if k in 'XYZ' else json.dumps(v)}\n" for k, v in row.items())
            for row in rows
        ]
        each.with_suffix(".toml").write_text("\n".join(tables), encoding="utf-8")
    written = [processing.strip(path.with_suffix(end), known.with_suffix(end)).document for end in (".csv", ".toml")]
    assert written[0] == written[1]


def test_out_holds_the_printed_document_the_tables_and_the_cards(tmp_path):
    models, ground = flat_strip(np.random.default_rng(3), 4, noise=0.02)
    path, known, out = models_file(tmp_path / "m.csv", models), ground_file(tmp_path / "g.csv", ground), tmp_path / "o"
    out.mkdir()
    done = reduce("strip", path, "--ground", known, "--polynomial", 2, "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert (out / "results.json").read_text(encoding="utf-8") == done.stdout
    assert sorted(each.name for each in out.iterdir()) == [
        "models.csv", "points.csv", "residuals.csv", "results.json", "strip.crd", "strip.pat",
    ]  # fmt: skip
    deck = read_cards(out / "strip.crd")
    assert [model.name for model in deck.models] == ["1", "2", "3"]
    with (out / "points.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            np.testing.assert_allclose(
                [float(row[axis]) for axis in "XYZ"], document["points"][row["point"]], atol=6e-7
            )
    with (out / "residuals.csv").open(encoding="utf-8") as file:
        residuals = {row["point"]: row for row in csv.DictReader(file)}
    for point, each in document["polynomial"]["residuals_m"].items():
        assert residuals[point]["role"] == each["role"]
        assert float(residuals[point]["Z"]) == pytest.approx(each["Z"], abs=6e-7)
    assert (out / "strip.pat").read_text(encoding="utf-8").count("-99\n") == 3
    again = processing.block([out / "models.csv"], known).document
    assert again["s0_m"] == pytest.approx(0.2, rel=0.2)


def test_output_cards_are_a_deck_again(tmp_path):
    models, ground = flat_strip(np.random.default_rng(3), 4, noise=0.02)
    path, known = models_file(tmp_path / "m.csv", models), ground_file(tmp_path / "g.csv", ground)
    first = processing.write_result(processing.strip(path, known), tmp_path / "o")
    again = processing.strip(tmp_path / "o" / "strip.crd").document
    assert again["absolute"]["scale"] == pytest.approx(1.0, abs=1e-5)
    for point, residual in again["residuals_m"].items():
        given = first["residuals_m"][point]
        np.testing.assert_allclose([residual[axis] for axis in "XYZ"], [given[axis] for axis in "XYZ"], atol=0.01)


@pytest.mark.parametrize("kind", ["models", "cards"])
def test_a_strip_comes_through_a_pipe(tmp_path, kind):
    models, ground = flat_strip(np.random.default_rng(3), 3)
    known = ground_file(tmp_path / "g.csv", ground)
    path = models_file(tmp_path / "m", models)
    if kind == "cards":
        path.write_text("".join(f"{line}\n" for line in deck_lines(ground, models)), encoding="ascii")
    done = subprocess.run(
        [sys.executable, "-m", "a7sim", "reduce", "strip", "/dev/stdin", "--ground", str(known), "--json"],
        input=path.read_bytes(),
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["input"] == kind


def test_values_too_long_for_a_card_are_reported_and_the_others_written(tmp_path):
    models, ground = flat_strip(np.random.default_rng(3), 3)
    long = Ground(ground.points, ground.coordinates + np.array([[446000.0], [4505000.0], [0.0]]), ground.roles)
    path, known = models_file(tmp_path / "m.csv", models), ground_file(tmp_path / "g.csv", long)
    done = reduce("strip", path, "--ground", known, "--out", tmp_path / "o")
    assert done.returncode == 0
    assert "strip.crd is not written" in done.stdout
    assert not (tmp_path / "o" / "strip.crd").exists()
    assert (
        "nine columns"
        in json.loads((tmp_path / "o" / "results.json").read_text(encoding="utf-8"))["not_written"]["strip.crd"]
    )


def test_polynomials_take_a_bow_away_and_name_it(tmp_path):
    models, ground = flat_strip(np.random.default_rng(4), 6)
    x = ground.coordinates[0] - 2950.0
    bent = ground.coordinates.copy()
    bent[2] += 3.0 * (x / 2250.0) ** 2
    known = ground_file(tmp_path / "g.csv", Ground(ground.points, bent, ground.roles))
    document = processing.strip(models_file(tmp_path / "m.csv", models), known, degree=2).document
    polynomial = document["polynomial"]
    assert document["accuracy_m"]["checks"]["height"] > 0.3
    assert polynomial["accuracy_m"]["checks"]["height"] < 0.02
    assert polynomial["deformation"]["vertical_sag_m"] == pytest.approx(-3.0, abs=0.2)
    assert set(polynomial["statistics"]) == {"plan", "height"}
    assert len(polynomial["coefficients"]) == 11


def test_differences_to_given_coordinates_are_tabled(tmp_path):
    models, ground = flat_strip(np.random.default_rng(5), 3)
    path, known = models_file(tmp_path / "m.csv", models), ground_file(tmp_path / "g.csv", ground)
    moved = Ground(ground.points, ground.coordinates + np.array([[0.3], [0.0], [-0.4]]), ground.roles)
    other = ground_file(tmp_path / "other.csv", moved)
    out = tmp_path / "o"
    document = processing.write_result(processing.strip(path, known, against=other), out)
    assert document["compare"]["rms"] == pytest.approx({"X": 0.3, "Y": 0.0, "Z": 0.4}, abs=1e-6)
    assert document["compare"]["largest"]["Z"] == pytest.approx(0.4, abs=1e-6)
    header, *rows = (out / "compare.csv").read_text(encoding="utf-8").splitlines()
    assert header == "point,X,Y,Z,dX,dY,dZ"
    assert len(rows) == len(ground.points)
    assert all(row.endswith(",0.400000") for row in rows)


def test_models_of_several_files_are_connected_and_closing_differences_given(tmp_path):
    models, _ = flat_strip(np.random.default_rng(6), 4, noise=0.02)
    paths = [models_file(tmp_path / f"{model.name}.csv", [model]) for model in models]
    one, other = (processing.connect(each).document for each in (paths, paths[::-1]))
    assert one == other
    assert [join["models"] for join in one["joins"]] == [["1", "2"], ["2", "3"]]
    assert set(one["joins"][0]["differences_mm"]) == {"110", "111", "112", "113", "2:centre"}
    assert 0.0 < one["joins"][0]["max_residual_mm"] < 0.2


def test_one_model_goes_to_the_ground_with_plan_and_height_control_only(tmp_path):
    models, ground = flat_strip(np.random.default_rng(7), 2)
    roles = ["plan", "height", "plan", "height", "height", "check", "height", "check"]
    rows = [
        f"{name},{'' if role == 'height' else x},{'' if role == 'height' else y},{'' if role == 'plan' else z},{role}"
        for name, (x, y, z), role in zip(ground.points, ground.coordinates.T, roles, strict=True)
    ]
    (tmp_path / "g.csv").write_text("point,X,Y,Z,role\n" + "\n".join(rows) + "\n", encoding="utf-8")
    document = processing.absolute(models_file(tmp_path / "m.csv", models), tmp_path / "g.csv").document
    assert document["absolute"]["scale"] > 0.0
    assert document["residuals_m"]["100"]["Z"] is None or np.isnan(document["residuals_m"]["100"]["Z"])
    for axis in "XYZ":
        assert abs(document["residuals_m"]["111"][axis]) < 1e-6
    assert document["statistics"]["redundancy"] == 1


def test_a_block_of_two_strips_is_recovered_exactly(tmp_path):
    first, ground = flat_strip(np.random.default_rng(8), 4)
    second, _ = flat_strip(np.random.default_rng(8), 4)
    renamed = [
        Model(
            str(10 + int(m.name)),
            tuple(f"{10 + int(name.split(':')[0])}:centre" if ":" in name else name for name in m.points),
            m.coordinates,
        )
        for m in second
    ]
    paths = [models_file(tmp_path / "1.csv", first), models_file(tmp_path / "2.csv", renamed)]
    known = ground_file(tmp_path / "g.csv", ground)
    outcome = processing.block(paths, known)
    document = processing.write_result(outcome, tmp_path / "o")
    assert document["s0_m"] < 1e-6
    assert document["accuracy_m"]["checks"]["height"] < 1e-6
    assert len(document["models"]) == 6
    assert set(document["models"][0]["sigma"]) == {"scale", "turn_X", "turn_Y", "turn_Z", "TX", "TY", "TZ"}
    assert (tmp_path / "o" / "strip-1.crd").exists()
    assert (tmp_path / "o" / "strip-2.crd").exists()
    with pytest.raises(A7SimError, match=r"1\.csv: expected models of its own"):
        processing.block([paths[0], paths[0]], known)


@pytest.mark.parametrize("columns", [80, 100])
def test_tables_of_a_strip_keep_to_the_width(tmp_path, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    models, ground = flat_strip(np.random.default_rng(9), 4, noise=0.02)
    path, known = models_file(tmp_path / "m.csv", models), ground_file(tmp_path / "g.csv", ground)
    done = reduce("strip", path, "--ground", known, "--polynomial", 2, "--reference", known)
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= columns
    for words in ("Absolute orientation", "Polynomials of degree 2", "twist", "mean square", "control, 8 points"):
        assert words in done.stdout
