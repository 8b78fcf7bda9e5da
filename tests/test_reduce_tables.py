"""Tables of `a7sim reduce` without --json: every number of the document that --json prints for the same file."""

import json

import numpy as np
import pytest

from tests.support.processes import a7sim_in_process
from tests.test_reduce_errors import CAMERA

FIDUCIALS = {"1": (-106.0, -106.0), "2": (106.0, 106.0), "3": (-106.0, 106.0), "4": (106.0, -106.0)}
RULED = [(x, y) for x in (0.0, 80.0) for y in (80.0, 0.0, -80.0)]
CENTRE = np.array([4999.3, 4992.5])


def rows(header, *lines):
    return "\n".join([header, *(",".join(map(str, line)) for line in lines)]) + "\n"


def counts():
    """Fiducials and a point of photograph 7 as counted, shrunk a little, and turned by a milliradian."""
    turned = {name: (x - 1e-3 * y + 0.002 * (name == "2"), y + 1e-3 * x) for name, (x, y) in FIDUCIALS.items()}
    places = (turned | {"P": (20.0, -30.0)}).items()
    return rows("photo,point,x,y", *(("7", name, 0.9998 * x, 0.9999 * y) for name, (x, y) in places))


def pair(blunder=0.0):
    """Nine points of a pair of c 152 mm with a base of 92 mm, the third of them with a blunder in y."""
    ground = [
        (x, y, -152.0 + 3.0 * ((i + j) % 3)) for i, x in enumerate((0, 46, 92)) for j, y in enumerate((-80, 0, 80))
    ]
    seen = [(-152.0 * x / z, -152.0 * y / z, -152.0 * (x - 92.0) / z, -152.0 * y / z) for x, y, z in ground]
    noise = 1e-3 * np.sin(np.arange(36.0)).reshape(9, 4)
    noise[2, 3] += blunder
    return rows("point,xl,yl,xr,yr", *((f"p{i}", *each) for i, each in enumerate(np.array(seen) + noise)))


def two_levels():
    slopes = np.array([(x, y) for x in (0.0, 195.0) for y in (0.0, 170.0, -170.0)]) / 2573.0
    seen = [(*(CENTRE + 2673.0 * s), *(CENTRE + 2473.0 * s + 0.01 * np.sin(900 * s))) for s in slopes]
    return rows("point,X1,Y1,X2,Y2", *((f"p{i}", *each) for i, each in enumerate(seen)))


def levels():
    slopes = np.array([(0.0, 0.03), (0.05, 0.01), (0.04, -0.06), (0.0, -0.05)])
    return rows(
        "point,level,X,Y",
        *(
            (f"p{i}", level, *(CENTRE + (7573.0 - level) * s + 0.01 * np.sin(level * s)))
            for i, s in enumerate(slopes)
            for level in (4900.0, 5000.0, 5100.0)
        ),
    )


def grid():
    """Crosses of a plate of c 152 mm, as the rods point at them from a centre at (10, 20, 400)."""
    at = [(10.0 + 2.0 * x, 20.0 + 2.0 * y, 400.0 - 2.0 * 152.0 + 0.01 * np.sin(x + y)) for x, y in RULED]
    return rows("point,x,y,X,Y,Z", *((f"p{i}", *a, *b) for i, (a, b) in enumerate(zip(RULED, at, strict=True))))


def common():
    at = np.array([(0.0, 0.0, 0.0), (100.0, 0.0, 10.0), (0.0, 100.0, 5.0), (100.0, 100.0, 0.0), (50.0, 40.0, 20.0)])
    to = 2.0 * at @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) + (500.0, 600.0, 70.0)
    to += 0.01 * np.sin(at)
    return rows("point,x,y,z,X,Y,Z", *((f"p{i}", *a, *b) for i, (a, b) in enumerate(zip(at, to, strict=True))))


@pytest.fixture(autouse=True)
def a_wide_terminal(monkeypatch):
    """Prevent the folding of cells."""
    monkeypatch.setenv("COLUMNS", "200")


def shown(folder, kind, content, *words):
    """The document, and the print-out of the same, its blanks and line ends made single blanks."""
    file = folder / "points.csv"
    file.write_text(content, encoding="utf-8")
    (folder / "camera.toml").write_text(CAMERA, encoding="utf-8")
    printed, as_json = (
        a7sim_in_process("reduce", kind, "points.csv", *words, *also, cwd=folder) for also in ((), ("--json",))
    )
    assert (printed.returncode, as_json.returncode) == (0, 0), printed.stderr + as_json.stderr
    return json.loads(as_json.stdout), printed.stdout


def lines(text):
    """The printed lines as their words; rules of tables left out."""
    return [each.replace("│", " ").split() for each in text.splitlines()]


@pytest.mark.parametrize("words", [(), ("--count-mm", "1")])
def test_interior_orientation_shows_unknowns_residuals_and_film(tmp_path, words):
    document, printed = shown(tmp_path, "interior", counts(), "--camera", "camera.toml", *words)
    (picture,) = document["photographs"]
    for name, unknown in picture["unknowns"].items():
        assert [name, f"{unknown['value']:.9g}", f"{unknown['sigma']:.2g}"] in lines(printed)
    for name, residual in picture["residuals_mm"].items():
        assert [name, *(f"{1e3 * v:.1f}" for v in residual)] in lines(printed)
    text = " ".join(printed.split())
    assert f"Photograph 7: {len(picture['points'])} point" in text
    assert f"s0 {1e3 * picture['s0_mm']:.1f} um, redundancy {picture['statistics']['redundancy']}" in text
    assert f"axes {picture['film']['shear_gon']:.4f} gon off square" in text
    assert ("film: shrunk by" in text) == ("scale" in picture["film"]) == bool(words)


@pytest.mark.parametrize("blunder", [0.0, 0.3])
def test_relative_orientation_shows_elements_points_and_blunders(tmp_path, blunder):
    document, printed = shown(tmp_path, "relative", pair(blunder), "--c", "152", "--method", "robust")
    for name, each in document["elements"].items():
        unit = "mm" if name.startswith("b") else "gon"
        assert [name, unit, f"{each['value']:.4f}", f"{each['sigma']:.4f}"] in lines(printed)
    parallaxes = document["residual_y_parallax_mm"]
    for name, place in document["points"].items():
        last = [f"{1e3 * parallaxes[name]:.1f}"] if name in parallaxes else ["taken", "out"]
        assert [name, *(f"{v:.4f}" for v in place), *last] in lines(printed)
    text = " ".join(printed.split())
    assert [each["point"] for each in document["blunders"]] == (["p2"] if blunder else [])
    for each in document["blunders"]:
        assert f"blunder at point {each['point']}: {each['parallax_mm']:.3f} mm of y-parallax" in text
    assert ("no blunders found" in text) == (not blunder)


def test_relative_orientation_by_every_method_stands_side_by_side(tmp_path):
    document, printed = shown(tmp_path, "relative", pair(), "--c", "152", "--method", "all")
    beside = [row for row in document["compare"]["rows"] if row["unit"] != "mm of the model"]
    assert beside
    for row in beside:
        numbers = [f"{value:.7f}" for value in row["values"].values()]
        quantity = f"{row['quantity']}, {row['unit']}" if row["unit"] else row["quantity"]
        assert [*quantity.split(), *numbers, f"{row['difference']:.1e}"] in lines(printed)
    assert "largest difference: " in printed


def test_six_points_are_too_few_to_name_a_blunder_and_this_is_reported(tmp_path):
    six = "\n".join(pair().splitlines()[:7]) + "\n"
    document, printed = shown(tmp_path, "relative", six, "--c", "152", "--method", "robust")
    assert not document["searchable"]
    assert "too few points to name one with a blunder: seven are the fewest" in " ".join(printed.split())


@pytest.mark.parametrize(
    ("content", "words"),
    [(two_levels, ()), (levels, ("--method", "levels")), (grid, ("--method", "grid", "--c", "152"))],
    ids=["two levels", "levels", "grid"],
)
def test_centres_show_their_unknowns_and_residuals(tmp_path, content, words):
    document, printed = shown(tmp_path, "centres", content(), *words)
    for name in ("X0", "Y0", "Z0", "T0"):
        if name in document:
            assert [name, f"{document[name]:.4f}", f"{document[f'sigma_{name}']:.4f}"] in lines(printed)
    for name, each in document.get("angles", {}).items():
        assert [f"{name},", "gon", f"{each['value']:.4f}", f"{each['sigma']:.4f}"] in lines(printed)
    for point, residual in document["residuals"].items():
        assert [point, *(f"{v:.4f}" for v in residual)] in lines(printed)
    last = f"rms {document['rms']:.4f}" if "rms" in document else f"s0 {1e3 * document['s0_mm']:.2f} um on the plate"
    assert last in printed


def test_a_similarity_shows_its_seven_unknowns_and_the_methods_side_by_side(tmp_path):
    document, printed = shown(tmp_path, "similarity", common(), "--method", "both")
    sigma = document["sigma"]
    assert ["scale", f"{document['scale']:.6f}", f"{sigma['scale']:.6f}"] in lines(printed)
    for name, value in document["angles"].items():
        assert [f"{name},", "gon", f"{value:.6f}", f"{sigma[name]:.6f}"] in lines(printed)
    for name, value in zip(("Tx", "Ty", "Tz"), document["translation"], strict=True):
        assert [name, f"{value:.6f}", f"{sigma[name]:.6f}"] in lines(printed)
    for point, residual in document["residuals"].items():
        assert [point, *(f"{v:.4f}" for v in residual)] in lines(printed)
    assert "Side by side" in printed and "largest difference: " in printed
