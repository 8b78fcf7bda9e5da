"""`a7sim reduce interior|relative|centres|similarity`: methods, their statistics, and the methods side by side."""

import csv
import json

import numpy as np
import pytest

from a7sim import processing
from a7sim.errors import A7SimError
from a7sim.geometry import GON, radially_displaced, refracted, rotation
from a7sim.processing.interior import FlightHeights
from tests.test_reduce import pair_file, reduce, toml


def camera_file(path, fiducials, c=152.0, more=""):
    marks = ", ".join(f'{{ name = "{name}", x = {x}, y = {y} }}' for name, x, y in fiducials)
    path.write_text(f"c = {c}\nfiducials = [{marks}]\n{more}", encoding="utf-8")
    return path


def counts_file(path, rows):
    path.write_text("photo,point,x,y\n" + "".join(f"{','.join(map(str, row))}\n" for row in rows), encoding="utf-8")
    return path


CORNERS = [("1", -106.0, -106.0), ("2", 106.0, 106.0), ("3", -106.0, 106.0), ("4", 106.0, -106.0)]


def test_a_published_interior_orientation_is_computed_to_its_digits(reference, tmp_path):
    data = toml(reference / "12_noobeed_interior.toml")
    marks = [(f["id"], f["x_mm"], f["y_mm"]) for f in data["fiducials"]]
    counts = counts_file(tmp_path / "counts.csv", [("1", f["id"], f["col"], f["row"]) for f in data["fiducials"]])
    done = reduce("interior", counts, "--camera", camera_file(tmp_path / "camera.toml", marks), "--json")
    unknowns = json.loads(done.stdout)["photographs"][0]["unknowns"]
    expected = data["expected"]
    for name in "abcd":
        assert unknowns[name]["value"] == pytest.approx(expected[name], abs=5e-9)
    for name, given in (("tx", "Cx"), ("ty", "Cy")):
        assert unknowns[name]["value"] == pytest.approx(expected[given], abs=6e-4)


def test_comparator_fiducials_of_a_real_pair_fit_to_some_microns(reference, tmp_path):
    marks = toml(reference / "02_calgary_lab_pair_27_28.toml")["interior"]["fiducials"]
    counts = counts_file(
        tmp_path / "counts.csv", [(n, f["id"], f[f"x{n}"], f[f"y{n}"]) for n in (27, 28) for f in marks]
    )
    camera = camera_file(tmp_path / "camera.toml", [(f["id"], f["x_cal"], f["y_cal"]) for f in marks], 153.358)
    document = json.loads(reduce("interior", counts, "--camera", camera, "--count-mm", 0.0119, "--json").stdout)
    for picture in document["photographs"]:
        assert picture["unknowns"]["a"]["value"] == pytest.approx(0.0119, rel=2e-4)
        assert picture["s0_mm"] < 0.006
        assert picture["statistics"]["redundancy"] == 10
        assert sum(picture["statistics"]["redundancy_numbers"].values()) == pytest.approx(10.0)
        x, y = picture["film"]["shrinkage_ppm"]
        assert picture["film"]["principal_distance_mm"] == pytest.approx(153.358 * (1 - (x + y) / 2e6), abs=1e-4)


@pytest.mark.parametrize("kind", ["conformal", "affine", "projective"])
def test_shrunk_film_comes_back_and_shortens_the_principal_distance(tmp_path, kind):
    turn = rotation(0.0, 0.0, 0.02)[:2, :2]
    places = [*CORNERS, ("p", 40.0, -70.0)]
    counts = [("9", name, *(100.0 * (turn @ (0.9999 * np.array([x, y])) + 120.0))) for name, x, y in places]
    path = counts_file(tmp_path / "counts.csv", counts)
    outcome = processing.interior(path, camera_file(tmp_path / "camera.toml", CORNERS), kind, 0.01)
    (picture,) = outcome.document["photographs"]
    np.testing.assert_allclose(picture["points"]["p"], [40.0, -70.0], atol=1e-9)
    assert picture["film"]["shrinkage_ppm"] == pytest.approx([100.01, 100.01], abs=0.01)
    assert picture["film"]["principal_distance_mm"] == pytest.approx(152.0 * 0.9999, abs=1e-7)


def test_lens_and_refraction_are_taken_off_and_pairs_are_written(tmp_path):
    true = {"a": (30.0, 60.0), "b": (80.0, -55.0)}
    camera = camera_file(
        tmp_path / "camera.toml", CORNERS, more="principal_point = [0.02, -0.01]\ndistortion = [2e-8, -1e-12]\n"
    )
    rows = []
    for photo, shift in (("28", -90.0), ("27", 0.0)):
        rows += [(photo, *mark) for mark in CORNERS]
        for name, (x, y) in true.items():
            seen = radially_displaced(refracted(np.array([x + shift, y]), 152.0, 3000.0, 500.0), [2e-8, -1e-12])
            rows.append((photo, name, seen[0] + 0.02, seen[1] - 0.01))
    path = counts_file(tmp_path / "counts.csv", rows)
    outcome = processing.interior(path, camera, corrections=("lens", "refraction"), flight=FlightHeights(3000.0, 500.0))
    assert outcome.document["about"] == "principal point"
    processing.write_result(outcome, tmp_path / "o")
    with (tmp_path / "o" / "pairs.csv").open(encoding="utf-8") as file:
        found = list(csv.DictReader(file))
    assert [row["model"] for row in found] == ["27-28"] * 2
    for row in found:
        x, y = true[row["point"]]
        seen = [float(row[column]) for column in ("xl", "yl", "xr", "yr")]
        np.testing.assert_allclose(seen, [x, y, x - 90.0, y], atol=1e-6)
    with pytest.raises(A7SimError, match="--flying-height"):
        processing.interior(path, camera, corrections=("curvature",))


def test_error_messages_name_confused_and_missing_fiducials_and_bad_cameras(tmp_path):
    camera = camera_file(tmp_path / "camera.toml", CORNERS)
    swapped = [("7", name, x, y) for name, (_, x, y) in zip("1324", CORNERS, strict=True)]
    with pytest.raises(A7SimError, match="photo 7: expected counts of the fiducials that lie as in the camera"):
        processing.interior(counts_file(tmp_path / "counts.csv", swapped), camera)
    mirrored = counts_file(tmp_path / "counts.csv", [("7", name, -x, y) for name, x, y in CORNERS])
    assert "mirrored" in processing.interior(mirrored, camera).document["warnings"][0]
    few = counts_file(tmp_path / "few.csv", [("7", *CORNERS[0]), ("7", *CORNERS[1])])
    with pytest.raises(A7SimError, match=r"few\.csv, photo 7: expected 3 fiducials"):
        processing.interior(few, camera)
    for text in ("c = 'x'\n", "camera = 3\n", "c = \n", ""):
        (tmp_path / "bad.toml").write_text(text, encoding="utf-8")
        with pytest.raises(A7SimError, match=r"^[^\n]*bad\.toml[^\n]*$"):
            processing.interior(few, tmp_path / "bad.toml")


def six_points(rng, noise, n=15):
    """A pair of moderately tilted photographs of n points, in mm."""
    object_points = np.array([rng.uniform(-10, 100, n), rng.uniform(-95, 95, n), rng.uniform(-170, -150, n)])
    turn = rotation(0.02, -0.01, 0.03)
    base = np.array([92.0, 2.0, -1.0])
    right = turn.T @ (object_points - base[:, None])
    images = [-152.0 * each[:2] / each[2] + noise * rng.standard_normal((2, n)) for each in (object_points, right)]
    return [
        {"id": f"{i + 1}", "xl": xl, "yl": yl, "xr": xr, "yr": yr}
        for i, (xl, yl, xr, yr) in enumerate(zip(*images[0], *images[1], strict=True))
    ]


@pytest.mark.parametrize("method", ["coplanarity", "parallax", "schut", "robust"])
def test_every_method_orients_a_faultless_pair_alike(tmp_path, method):
    path = pair_file(tmp_path / "pair.csv", six_points(np.random.default_rng(1), 0.0))
    document = processing.relative(path, 152.0, (0.0, 0.0), "dependent", 92.0, method).document
    np.testing.assert_allclose(document["rotation"], rotation(0.02, -0.01, 0.03), atol=1e-9)
    assert document["elements"]["by2"]["value"] == pytest.approx(2.0, abs=1e-7)
    assert document["statistics"]["redundancy"] == 10
    assert np.shape(document["statistics"]["correlations"]) == (5, 5)
    assert document["converged"]


def test_the_robust_method_names_the_point_with_the_blunder(tmp_path):
    points = six_points(np.random.default_rng(2), 0.004)
    points[6]["yr"] += 0.3
    path = pair_file(tmp_path / "pair.csv", points)
    done = reduce("relative", path, "--c", 152, "--method", "robust")
    assert "blunder at point 7:" in done.stdout
    assert "taken out" in done.stdout
    document = processing.write_result(
        processing.relative(path, 152.0, (0.0, 0.0), "dependent", 92.0, "robust"), tmp_path / "o"
    )
    model = (tmp_path / "o" / "models.csv").read_text(encoding="utf-8")
    assert "pair,8," in model
    assert "pair,7," not in model
    assert [each["point"] for each in document["blunders"]] == ["7"]
    assert "7" not in document["residual_y_parallax_mm"]
    assert "7" in document["points"]


def test_all_methods_stand_side_by_side(tmp_path):
    path = pair_file(tmp_path / "pair.csv", six_points(np.random.default_rng(3), 0.004))
    done = reduce("relative", path, "--c", 152, "--method", "all", "--out", tmp_path / "o")
    assert done.returncode == 0, done.stderr
    assert "largest difference" in done.stdout
    with (tmp_path / "o" / "compare.csv").open(encoding="utf-8") as file:
        rows = {row["quantity"]: row for row in csv.DictReader(file)}
    methods = ("coplanarity", "parallax", "schut", "robust")
    for row in rows.values():
        values = [float(row[method]) for method in methods]
        assert float(row["difference"]) == pytest.approx(max(values) - min(values), rel=1e-3, abs=1e-9)
    assert float(rows["omega2"]["difference"]) < 0.01
    with pytest.raises(A7SimError, match="dependent"):
        processing.relative(path, 152.0, (0.0, 0.0), "independent", 92.0, "all")


def test_both_similarities_agree_and_report_it(reference, tmp_path):
    common = toml(reference / "03_dewitt_public_domain.toml")["similarity"]["common"]
    path = tmp_path / "common.csv"
    rows = [",".join(str(p[k]) for k in ("id", "x", "y", "z", "X", "Y", "Z")) for p in common]
    path.write_text("point,x,y,z,X,Y,Z\n" + "\n".join(rows[::-1]) + "\n", encoding="utf-8")
    document = processing.similarity(path, "both").document
    assert max(document["compare"]["largest_difference"].values()) < 1e-9
    alone = processing.similarity(path, "quaternion").document
    assert [alone["method"], alone["iterations"]] == ["quaternion", 0]
    np.testing.assert_allclose(alone["sigma"]["scale"], document["sigma"]["scale"], rtol=1e-9)


def pointings(levels):
    slopes = np.array([(x, y) for x in (0.0, 195.0) for y in (0.0, 170.0, -170.0)]) / 2573.0
    return {
        (f"p{i}", level): np.array([4999.3, 4992.5]) + slope * (7573.0 - level)
        for i, slope in enumerate(slopes)
        for level in levels
    }


def test_a_centre_comes_from_pointings_at_any_number_of_levels(tmp_path):
    rows = [f"{name},{level},{x},{y}" for (name, level), (x, y) in pointings((5100, 4900, 5000, 5200)).items()]
    path = tmp_path / "levels.csv"
    path.write_text("point,level,X,Y\n" + "\n".join(rows) + "\n", encoding="utf-8")
    document = processing.centres(path, method="levels").document
    assert [document[name] for name in ("X0", "Y0", "Z0")] == pytest.approx([4999.3, 4992.5, 7573.0], abs=1e-6)
    assert document["pointing_rms"] < 1e-9
    path.write_text("point,level,X,Y\n" + "\n".join(rows[:-1]) + "\n", encoding="utf-8")
    with pytest.raises(A7SimError, match="none of point p5 at 5200"):
        processing.centres(path, method="levels")


def test_a_centre_comes_from_a_grid_plate(tmp_path):
    turn, centre = rotation(0.01, -0.02, 0.5), np.array([300.0, 250.0, 400.0])
    rows = []
    for i, (x, y) in enumerate((x, y) for x in (-80.0, 0.0, 80.0) for y in (-80.0, 0.0, 80.0)):
        ray = turn @ (x, y, -152.0)
        rows.append(f"{i},{x},{y},{','.join(map(str, centre + ray * ((40.0 - 400.0) / ray[2])))}")
    path = tmp_path / "grid.csv"
    path.write_text("point,x,y,X,Y,Z\n" + "\n".join(rows) + "\n", encoding="utf-8")
    done = reduce("centres", path, "--method", "grid", "--c", 152, "--json")
    document = json.loads(done.stdout)
    assert [document[name] for name in ("X0", "Y0", "Z0")] == pytest.approx(centre.tolist(), abs=1e-6)
    angles = [document["angles"][name]["value"] * GON for name in ("omega", "phi", "kappa")]
    assert angles == pytest.approx([0.01, -0.02, 0.5], abs=1e-9)
    with pytest.raises(A7SimError, match="--c"):
        processing.centres(path, method="grid")


def test_centres_of_an_a8_come_from_its_base_scale(tmp_path):
    path = tmp_path / "a8.csv"
    path.write_text("model,base,column,height\n1,180,420,15\n", encoding="utf-8")
    document = processing.centres(path, method="a8").document
    assert document["models"]["1"] == {"left": [155.0, 200.0, 435.0], "right": [245.0, 200.0, 435.0]}
