"""The scene: ground, photographs, and files of measured image coordinates."""

import tomllib

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim.errors import A7SimError
from a7sim.geometry import GON, image_of, rotation
from a7sim.scenario import load_scenario
from a7sim.scenario.schema import Air, Camera, Fiducial, FilmDeformation, Measured, Terrain
from a7sim.scene import build_scene
from a7sim.scene.camera import distorted, lowered_by_curvature, refracted
from a7sim.scene.measured import measured_marks
from a7sim.scene.terrain import GroundSurface

FAULTLESS_FILM = FilmDeformation()


def akwanga(**changes):
    return msgspec.structs.replace(load_scenario("akwanga"), **changes)


@given(st.integers(0, 50), st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
def test_the_ground_stays_within_its_relief(seed, east, north):
    ground = GroundSurface.of(Terrain(mean_height=459.08, relief=28.84, wavelength=700.0, seed=seed))
    assert abs(float(ground.height(np.array(east), np.array(north))) - 459.08) <= 28.84 + 1e-9


def test_a_ray_meets_the_ground_on_the_ground():
    ground = GroundSurface.of(Terrain(mean_height=459.08, relief=28.84, wavelength=700.0, seed=6))
    centre = np.array([440000.0, 985000.0, 1680.0])
    direction = np.array([[30.0, -60.0, 0.0], [80.0, 10.0, 0.0], [-152.0, -152.0, -152.0]])
    met = ground.intersect(centre, direction)
    np.testing.assert_allclose(met[2], ground.height(met[0], met[1]), atol=0.02)


def test_undeformed_film_holds_the_exact_images_about_the_principal_point():
    scenario = akwanga(film=FAULTLESS_FILM)
    scene = build_scene(scenario, 1)
    for photo in scenario.photos:
        turned = rotation(photo.omega * GON, photo.phi * GON, photo.kappa * GON)
        marks = scene.photographs[photo.name].points
        ground = np.array([scene.ground_points[name] for name in marks.names]).T
        exact = image_of(ground, np.array(photo.position)[:, None], turned, scenario.camera.c)
        np.testing.assert_allclose(marks.xy, exact + np.array(scenario.camera.principal_point)[:, None], atol=1e-9)


def test_the_standard_points_are_those_of_figure_4_1():
    scenario = akwanga(film=FAULTLESS_FILM)
    scene = build_scene(scenario, 1)
    left = scene.photographs["101"].points
    where = {label: left.get(name) for label, name in scene.standard_points["1"].items()}
    for row in ("3adg4", "1beh2", "5cfi6"):
        assert [where[label][0] for label in row] == sorted(where[label][0] for label in row)
    for column in ("315", "abc", "def", "ghi", "426"):
        assert [where[label][1] for label in column] == sorted((where[label][1] for label in column), reverse=True)
    assert scene.standard_points["1"]["2"] == scene.standard_points["2"]["1"] == "1021"


def test_film_shrinks_and_its_noise_has_the_given_standard_deviation():
    many = [
        build_scene(
            akwanga(film=FilmDeformation(shrinkage_ppm=(500.0, 300.0), irregular_um=3.0, identification_um=4.0)), seed
        )
        for seed in range(40)
    ]
    exact = build_scene(akwanga(film=FAULTLESS_FILM), 1).photographs["102"]
    names = exact.points.names
    scaled = exact.points.xy * np.array([[1.0 - 500e-6], [1.0 - 300e-6]])
    errors = np.array([[each.photographs["102"].points.get(n) for n in names] for each in many]) - scaled.T
    assert np.abs(errors.mean(axis=0)).max() < 0.004
    assert errors.std() == pytest.approx(0.005, rel=0.05)


def test_the_same_seed_gives_the_same_film_and_another_gives_another_film():
    first, again, other = (build_scene(akwanga(), seed).photographs["101"].points.xy for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-4


def test_curvature_and_refraction_can_be_switched_on_with_the_size_of_the_textbook():
    straight, bent = (build_scene(akwanga(film=FAULTLESS_FILM, air=air), 1) for air in (
        Air(),
        Air(earth_curvature=True, refraction=True),
    ))  # fmt: skip
    difference = straight.photographs["101"].points.xy - bent.photographs["101"].points.xy
    assert 0.0001 < np.abs(difference).max() < 0.02
    # 10 km from the nadir the earth falls away 7.85 m; at 100 mm and 6 km flying height refraction is some 8 um.
    lowered = lowered_by_curvature(np.array([10_000.0, 0.0, 0.0]), np.zeros(3))
    assert lowered[2] == pytest.approx(-7.85, abs=0.01)
    assert 1000.0 * (refracted(np.array([100.0, 0.0]), 152.0, 6000.0, 0.0)[0] - 100.0) == pytest.approx(8.3, abs=1.5)


def test_distortion_is_radial_and_outward_for_a_positive_coefficient():
    camera = Camera(c=152.0, fiducials=load_scenario("akwanga").camera.fiducials, distortion=[1e-8])
    image = np.array([60.0, 80.0])
    np.testing.assert_allclose(distorted(camera, image) / image, 1.0 + 1e-8 * 1e4)


def test_the_real_pair_is_mounted_as_measured():
    scene = build_scene(load_scenario("dewitt-pair"), 1)
    assert scene.photographs["left"].points.get("e") == pytest.approx([-4.668, -86.821])
    assert scene.photographs["right"].points.get("f") == pytest.approx([-0.965, -94.319])
    relative = scene.relative_truth(load_scenario("dewitt-pair").models[0])
    assert relative.source.startswith("Dewitt")


def test_comparator_counts_are_transformed_to_film_by_their_fiducials(reference, tmp_path):
    """Reference 02: eight fiducials of a real photograph; residuals of film and pointing are some hundredths of mm."""
    data = tomllib.loads((reference / "02_calgary_lab_pair_27_28.toml").read_text(encoding="utf-8"))
    fiducials = data["interior"]["fiducials"]
    camera = Camera(
        c=data["c_mm"], fiducials=[Fiducial(name=str(f["id"]), x=f["x_cal"], y=f["y_cal"]) for f in fiducials]
    )
    rows = [f"27,{f['id']},{f['x27']},{f['y27']}" for f in fiducials] + ["27,P,10254.0,-10377.5"]
    (tmp_path / "counts.csv").write_text("photo,point,x,y\n" + "\n".join(rows) + "\n", encoding="utf-8")
    measured = Measured(file=str(tmp_path / "counts.csv"), units="counts")
    marks, points = measured_marks(measured, "27", camera)
    calibrated = np.array([(f["x_cal"], f["y_cal"]) for f in fiducials]).T
    assert np.sqrt(((marks.xy - calibrated) ** 2).mean()) < 0.03
    assert points.get("P") == pytest.approx([0.0, 0.0], abs=0.05)
    fixed = Measured(file=str(tmp_path / "counts.csv"), units="counts", count_mm=0.0119)
    shrunk, _ = measured_marks(fixed, "27", camera)
    distances = [np.hypot(*(each.xy[:, 0] - each.xy[:, 1])) for each in (shrunk, marks)]
    assert distances[0] == pytest.approx(0.0119 * np.hypot(17814.75, 17814.5), abs=1e-6)
    assert distances[0] != pytest.approx(distances[1], abs=1e-3)


def test_the_mirroring_of_counts_by_the_comparator_is_undone(tmp_path):
    camera = load_scenario("akwanga").camera
    rows = [f"p,{f.name},{1000 + 100 * f.x},{5000 - 100 * f.y}" for f in camera.fiducials] + ["p,P,3000,4000"]
    (tmp_path / "counts.csv").write_text("photo,point,x,y\n" + "\n".join(rows), encoding="utf-8")
    _, points = measured_marks(Measured(file=str(tmp_path / "counts.csv"), units="counts"), "p", camera)
    assert points.get("P") == pytest.approx([20.0, 10.0])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["empty file"]),
        ("point,x,y\na,1,2\n", ["line 1", "photo"]),
        ("photo,point,x,y\nleft,a,1,2\nleft,b,1\n", ["line 3", "4 columns", "got 3"]),
        ("photo,point,x,y\nleft,a,1,two\n", ["line 2", "column y", "'two'"]),
        ("photo,point,x,y\n# remark\nleft,a,1,2\nleft,a,3,4\n", ["line 4", "line 3"]),
        ("photo,point,x,y\nright,a,1,2\n", ["'left'", "none"]),
        ('photo,point,x,y\nleft,"a""b",1,2\n', ["column point", "without quotes"]),
        ("photo,point,x,y\nleft,a,1,200\n", ["format", "(1.0, 200.0) for point a"]),
    ],
)
def test_the_error_message_for_a_bad_file_names_line_and_column(tmp_path, content, words):
    path = tmp_path / "bad.csv"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(A7SimError) as caught:
        measured_marks(Measured(file=str(path)), "left", load_scenario("akwanga").camera)
    message = str(caught.value)
    assert "\n" not in message
    for word in ["bad.csv", *words]:
        assert word in message


@pytest.mark.parametrize(
    ("scale", "moved", "words"),
    [
        ({}, [], "expected 3 or more of the fiducials"),
        ({"1": 1.0, "2": 1.0, "3": 1.0, "4": 1.0}, ["1", "3"], "fiducials that lie as in the camera"),
    ],
    ids=["none measured", "two confused"],
)
def test_counts_with_missing_or_confused_fiducials_are_rejected(tmp_path, scale, moved, words):
    camera = load_scenario("akwanga").camera
    other = dict(zip(moved, reversed(moved), strict=True))
    named = [(other.get(f.name, f.name), f) for f in camera.fiducials if f.name in scale]
    rows = [f"p,{name},{1000 + 100 * f.x},{5000 + 100 * f.y}" for name, f in named] + ["p,P,3000,4000"]
    (tmp_path / "counts.csv").write_text("photo,point,x,y\n" + "\n".join(rows), encoding="utf-8")
    with pytest.raises(A7SimError, match=words):
        measured_marks(Measured(file=str(tmp_path / "counts.csv"), units="counts"), "p", camera)
