"""`a7sim reduce` on real measurements, by files.md."""

import json
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from a7sim import processing
from a7sim.errors import A7SimError
from a7sim.geometry import GON, rotation
from tests.support.processes import a7sim_in_process

ROOT = Path(__file__).parents[1]


def reduce(*arguments):
    return a7sim_in_process("reduce", *arguments, cwd=ROOT)


def toml(path):
    return tomllib.loads(path.read_text(encoding="utf-8"))


def pair_file(path, points):
    rows = [f"{p['id']},{p['xl']},{p['yl']},{p['xr']},{p['yr']}" for p in points]
    path.write_text("point,xl,yl,xr,yr\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def strip_files(folder, data, number, swapped=False):
    """The pairs and the ground file of one of the two strips of reference 05."""
    photos = {1: (321, 320, 319), 2: (332, 333, 334)}[number]
    seen = {(i["photo"], i["id"]): (i["x"], i["y"]) for i in data["data"]["image"] if i["strip"] == number}
    rows = [
        f"{left}-{right},{point},{x},{y},{','.join(map(str, seen[right, point]))}"
        for left, right in pairwise(photos)
        for (photo, point), (x, y) in seen.items()
        if photo == left and (right, point) in seen
    ]
    pairs, ground = folder / "pairs.csv", folder / "ground.csv"
    pairs.write_text("model,point,xl,yl,xr,yr\n" + "\n".join(rows) + "\n", encoding="utf-8")
    axes = ("N", "E") if swapped else ("E", "N")
    known = [f"{p['id']},{p[axes[0]]},{p[axes[1]]},{p['H']},control" for p in data["data"]["control"]]
    ground.write_text("point,X,Y,Z,role\n" + "\n".join(known) + "\n", encoding="utf-8")
    return pairs, ground


def test_the_published_pair_is_computed_to_its_digits(reference):
    expected = toml(reference / "03_dewitt_public_domain.toml")["relative_orientation"]
    document = json.loads(
        reduce(
            "relative",
            "scenarios/dewitt-pair.csv",
            "--c",
            152.113,
            "--bx",
            np.linalg.norm(expected["expected_base_mm"]),
            "--json",
        ).stdout
    )
    assert list(document)[:2] == ["schema_version", "command"]
    turned = rotation(*np.radians(expected["expected_omega_phi_kappa_deg"]))
    np.testing.assert_allclose(document["rotation"], turned, atol=2e-6)
    base = np.array(expected["expected_base_mm"])
    np.testing.assert_allclose(document["base"], base / np.linalg.norm(base), atol=2e-6)
    elements = document["elements"]
    for name, degrees, sd in zip(
        ("omega2", "phi2", "kappa2"), expected["expected_omega_phi_kappa_deg"], expected["expected_sd_deg"], strict=True
    ):
        assert elements[name]["value"] * 0.9 == pytest.approx(degrees, abs=6e-5)
        assert elements[name]["sigma"] * 0.9 == pytest.approx(sd, abs=6e-5)
    assert document["s0_mm"] == pytest.approx(expected["expected_s0_mm"], abs=6e-5)
    for point in expected["expected_object"]:
        place = np.array(document["points"][point["id"]])
        given = np.array([point["X"], point["Y"], point["Z"] - expected["c_mm"]])
        np.testing.assert_allclose(place, given, atol=0.01)


def test_another_published_pair_is_computed_to_its_digits(reference, tmp_path):
    expected = toml(reference / "02_calgary_lab_pair_27_28.toml")
    path = pair_file(tmp_path / "pair.csv", expected["relative_a"]["points"])
    document = processing.relative(path, expected["c_mm"], (0.0, 0.0), "dependent", expected["bx_mm"]).document
    values = [document["elements"][name]["value"] for name in ("omega2", "phi2", "kappa2")]
    degrees = expected["relative_a"]["expected_omega_phi_kappa_deg"]
    np.testing.assert_allclose(np.degrees(np.array(values) * GON), degrees, atol=2e-4)
    by_bz = [document["elements"][name]["value"] for name in ("by2", "bz2")]
    np.testing.assert_allclose(by_bz, expected["relative_a"]["expected_by_bz_mm"], atol=2e-3)


@pytest.mark.parametrize("number", [1, 2])
def test_two_real_strips_go_from_image_to_ground_by_one_command_each(reference, tmp_path, number):
    data = toml(reference / "05_wuhan_two_strips.toml")
    pairs, ground = strip_files(tmp_path, data, number)
    x0, y0 = data["x0_y0_mm"]
    done = reduce("strip", pairs, "--c", data["c_mm"], "--x0", x0, "--y0", y0, "--ground", ground, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    expected = data["expected"]
    assert [len(document["models"]), len(document["joins"])] == [2, 1]
    assert document["joins"][0]["scale"] == pytest.approx(expected["join_scale"][f"strip{number}"], abs=6e-6)
    assert document["absolute"]["scale"] == pytest.approx(expected[f"strip{number}_absolute_scale"], rel=2e-7)
    residuals = [[each[axis] for axis in "XYZ"] for each in document["residuals_m"].values()]
    largest = np.abs(residuals).max(axis=0)
    assert (largest <= np.array(expected[f"strip{number}_control_max_residual_m"]) + 0.0006).all()
    assert not any("left-handed" in warning for warning in document["warnings"])


def test_north_and_east_swapped_give_the_warning(reference, tmp_path):
    data = toml(reference / "05_wuhan_two_strips.toml")
    pairs, ground = strip_files(tmp_path, data, 1, swapped=True)
    done = reduce("strip", pairs, "--c", data["c_mm"], "--ground", ground)
    assert done.returncode == 0
    assert "warning" in done.stdout
    assert "left-handed" in " ".join(done.stdout.split())


def test_the_published_similarity_is_computed_to_its_digits(reference, tmp_path):
    expected = toml(reference / "03_dewitt_public_domain.toml")["similarity"]
    rows = [",".join(str(p[k]) for k in ("id", "x", "y", "z", "X", "Y", "Z")) for p in expected["common"]]
    path = tmp_path / "common.csv"
    path.write_text("point,x,y,z,X,Y,Z\n" + "\n".join(rows) + "\n", encoding="utf-8")
    document = json.loads(reduce("similarity", path, "--json").stdout)
    assert document["scale"] == pytest.approx(expected["expected_scale"], abs=6e-6)
    np.testing.assert_allclose(document["translation"], expected["expected_T"], atol=6e-4)
    assert document["s0"] == pytest.approx(expected["expected_s0"], abs=6e-6)
    assert document["sigma"]["scale"] == pytest.approx(expected["expected_sd"]["scale"], abs=6e-6)
    for name in ("Tx", "Ty", "Tz"):
        assert document["sigma"][name] == pytest.approx(expected["expected_sd"][name], abs=6e-4)
    angles = [document["angles"][name] * 0.9 for name in ("omega", "phi", "kappa")]
    np.testing.assert_allclose(angles, expected["expected_omega_phi_kappa_deg"], atol=6e-5)


def test_a_centre_comes_from_pointings_at_two_levels(tmp_path):
    slopes = np.array([(x, y) for x in (0.0, 195.0) for y in (0.0, 170.0, -170.0)]) / 2573.0
    centre = np.array([4999.3, 4992.5])
    pointings = [[*(centre + s * (7573.0 - 4900.0)), *(centre + s * (7573.0 - 5100.0))] for s in slopes]
    rows = [f"p{i},{','.join(f'{v:.6f}' for v in each)}" for i, each in enumerate(pointings)]
    path = tmp_path / "pointings.csv"
    path.write_text("point,X1,Y1,X2,Y2\n" + "\n".join(rows) + "\n", encoding="utf-8")
    document = json.loads(reduce("centres", path, "--out", tmp_path / "out", "--json").stdout)
    assert [document[name] for name in ("X0", "Y0", "Z0", "T0")] == pytest.approx(
        [4999.3, 4992.5, 7573.0, 13.365], abs=1e-3
    )
    assert json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8")) == document


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("point,xl,yl,xr\na,1,2,3\n", ["line 1", "yr"]),
        ("point,xl,yl,xr,yr\na,1,2,x,4\n", ["line 2", "column xr", "'x'"]),
        ("point,xl,yl,xr,yr\na,1,2,3,4\na,1,2,3,4\n", ["line 3", "line 2"]),
        ("", ["empty file"]),
        ("point,xl,yl,xr,yr\na,1,2,-91,4\nb,2,3,-90,5\n", ["at least 5 points", "got 2"]),
        ("point,xl,yl,xr,yr\n" + "".join(f"{i},{10 * i},0,{10 * i - 90},0\n" for i in range(8)), ["condition number"]),
    ],
)
def test_the_error_message_of_a_bad_pair_file_is_one_sentence_with_its_place(tmp_path, content, words):
    path = tmp_path / "bad.csv"
    path.write_text(content, encoding="utf-8")
    done = reduce("relative", path, "--c", 152)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    for word in ["bad.csv", *words]:
        assert word in done.stderr


def test_a_hundred_megabytes_of_noise_are_refused_unread(tmp_path):
    path = tmp_path / "noise.csv"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(A7SimError, match="at most"):
        processing.relative(path, 152.0, (0.0, 0.0), "dependent", 92.0)


def test_an_unknown_role_is_named_with_its_line(tmp_path):
    (tmp_path / "ground.csv").write_text("point,X,Y,Z,role\n1,0,0,0,kontrol\n", encoding="utf-8")
    pair_file(tmp_path / "pairs.csv", [])
    (tmp_path / "pairs.csv").write_text("model,point,xl,yl,xr,yr\n1,a,1,2,3,4\n", encoding="utf-8")
    done = reduce("strip", tmp_path / "pairs.csv", "--c", 152, "--ground", tmp_path / "ground.csv")
    assert done.returncode == 2
    assert "line 2, column role" in done.stderr
