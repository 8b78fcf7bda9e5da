"""The report of a session: one self-contained page with the numbers of the results."""

import base64
import json
import re
import shutil
import subprocess
import sys

import pytest

from a7sim.report.pointing_rays import pointing_rays
from a7sim.report.render import render_report
from a7sim.report.session_folder import read_session
from tests.support.html_pages import Page

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.fixture(scope="module")
def results(akwanga_folder):
    return json.loads((akwanga_folder / "results.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def text(akwanga_folder):
    return render_report(read_session(akwanga_folder))


@pytest.fixture(scope="module")
def page(text):
    return Page(text)


def changed(folder, results, tmp_path):
    """Copy the folder of a session with other results."""
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    (copy / "results.json").write_text(json.dumps(results), encoding="utf-8")
    return copy


def test_a_report_is_written_into_the_folder_or_to_the_path_given(gave_up_folder, tmp_path, typed):
    copy = tmp_path / "session"
    shutil.copytree(gave_up_folder, copy)
    code, printed, _ = typed("report", copy)
    assert (code, printed) == (0, f"{copy / 'report.html'}\n")
    elsewhere = tmp_path / "elsewhere.html"
    assert typed("report", gave_up_folder, "--out", elsewhere)[0] == 0
    assert elsewhere.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert not (gave_up_folder / "report.html").exists()


def test_a_report_is_deleted_with_the_session_that_is_overwritten(gave_up_folder, tmp_path, typed):
    copy = tmp_path / "session"
    shutil.copytree(gave_up_folder, copy)
    assert typed("report", copy)[0] == 0
    assert typed("run", "akwanga", "--set", "photos.1.laid=upside down", "--force", "--out", copy)[0] == 1
    assert not (copy / "report.html").exists()


def test_a_report_of_the_same_session_is_the_same_to_the_byte(finished):
    folder = finished("dewitt-pair", 7).folder
    assert render_report(read_session(folder)) == render_report(read_session(folder))


def test_a_report_can_be_shown_in_the_browser(gave_up_folder, tmp_path, typed, monkeypatch):
    shown = []
    monkeypatch.setattr("webbrowser.open", shown.append)
    assert typed("report", gave_up_folder, "--open", "--out", tmp_path / "r.html")[0] == 0
    assert shown == [(tmp_path / "r.html").as_uri()]


def test_the_page_loads_nothing_from_outside(text, page):
    assert not re.search(r"https?:|//[a-z]|@import|url\((?!#)", text)
    for tag, attributes in page.elements:
        assert tag not in ("script", "iframe", "object")
        for name in ("src", "href"):
            assert attributes.get(name, "#").startswith(("#", "data:"))


def test_every_id_on_the_page_is_unique_and_every_reference_has_a_target(text, page):
    assert len(set(page.ids)) == len(page.ids)
    wanted = {attributes["href"][1:] for _, attributes in page.elements if attributes.get("href", "").startswith("#")}
    wanted |= set(re.findall(r"url\(#([^)]*)\)", text))
    assert wanted <= set(page.ids)


def test_every_figure_has_an_accessible_name(page):
    drawn = [attributes for tag, attributes in page.elements if tag == "svg"]
    assert len(drawn) == 2 * 4 + 3 + 2
    for attributes in drawn:
        assert attributes["role"] == "img"
        assert set(attributes["aria-labelledby"].split()) <= set(page.ids)
    assert sum(tag == "figcaption" for tag, _ in page.elements) == len(drawn)


def test_every_table_has_a_caption_and_headers_with_their_scope(page):
    assert len(page.tables) > 20
    for table in page.tables:
        assert table.caption
        assert "col" in table.scopes
        assert table.scopes.count("row") == len(table.rows)
        assert set(table.scopes) == {"col", "row"}
        assert {len(row) for row in table.rows} == {len(table.columns)}


def test_figures_use_the_colours_of_the_page(text):
    """Figures contain no other colours, so that they stay legible in dark mode and in print."""
    drawn = "".join(re.findall(r"<svg.*?</svg>", text, flags=re.DOTALL))
    assert not re.search(r"#[0-9a-fA-F]{6}\b", drawn)
    used = set(re.findall(r"var\((--\w+)\)", drawn))
    for scheme in re.findall(r":root \{(.*?)\}", text, flags=re.DOTALL):
        assert used <= set(re.findall(r"(--\w+):", scheme))


def test_residual_parallaxes_equal_those_of_the_results(page, results):
    tables = [table for table in page.tables if table.caption == "Residual y-parallaxes"]
    for table, model in zip(tables, results["models"], strict=True):
        residuals = model["relative_orientation"]["residual_parallax_mm"]
        assert {row[0]: float(row[2]) for row in table.rows} == residuals
        assert {row[0]: row[1] for row in table.rows} == model["standard_points"]


def test_centres_equal_those_of_the_results(page, results):
    tables = [table for table in page.tables if table.caption == "Perspective centres, counter units"]
    for table, model in zip(tables, results["models"], strict=True):
        left, right = (model["perspective_centres"][side] for side in ("left", "right"))
        for name in ("X0", "Y0", "Z0", "T0"):
            row = table.row(name)
            assert (row[1], row[2], row[4], row[5]) == tuple(
                f"{side[key]:.3f}" for side in (left, right) for key in (name, f"sigma_{name}")
            )


def test_a_prime_is_the_left_projector_also_with_base_out(page):
    text = "".join(page.text)
    assert "Model 1: perspective centre O′, left photograph 101" in text
    assert "Model 2: perspective centre O″, left photograph 102" in text


def test_residuals_on_the_ground_equal_those_of_the_results(page, results):
    table = page.table("Residuals, computed minus given, m")
    expected = results["strip"]["residuals_m"]
    assert [row[0] for row in table.rows] == list(expected)
    for point, role, *xyz in table.rows:
        assert role == expected[point]["role"]
        assert xyz == [f"{expected[point][axis]:+.3f}" for axis in "XYZ"]


def test_hours_equal_those_of_the_results(page, results):
    table = page.table("Hours by activity")
    assert {row[0]: float(row[1]) for row in table.rows} == results["operator"]["time_by_activity_h"]


def test_the_page_contains_the_command_that_reproduces_the_session(page, results):
    table = page.table("What gives this session again")
    assert table.row("command line")[1] == results["command_line"] == "a7sim run akwanga --seed 7"
    assert table.row("seed")[1] == "7"
    assert table.row("software")[1] == results["software"]


def test_a_changed_setting_is_reported_with_its_request(gave_up_folder):
    page = Page(render_report(read_session(gave_up_folder)))
    line = page.table("What gives this session again").row("command line")[1]
    assert line == "a7sim run akwanga --seed 1985 --set 'photos.1.laid=upside down' --skill novice"
    changed = {row[0]: row[1] for row in page.table("Changed in the scenario's file").rows}
    assert changed == {"photos.1.laid": "upside down", "observer.skill": '"novice"'}


def test_the_report_of_a_session_that_does_not_fit_states_this_and_shows_the_existing_results(gave_up_folder):
    page = Page(render_report(read_session(gave_up_folder)))
    assert "does not fit: picture 102 lies upside down" in "".join(page.text)
    assert "Hours by activity" in [table.caption for table in page.tables]
    assert not [table for table in page.tables if "centres" in table.caption]


def test_the_report_of_an_interrupted_session_shows_the_existing_results(akwanga_folder, results, tmp_path):
    half = {key: value for key, value in results.items() if key != "strip"}
    half |= {"status": "interrupted", "message": "the session was interrupted", "models": results["models"][:1]}
    page = Page(render_report(read_session(changed(akwanga_folder, half, tmp_path))))
    assert "The session was interrupted" in "".join(page.text)
    assert sum(table.caption == "Elements as set" for table in page.tables) == 1


def test_rays_of_the_points_give_the_rms_of_the_centre(akwanga_folder, results):
    """Book and results agree on a centre, with second sets and struck entries."""
    kept = read_session(akwanga_folder)
    for model in results["models"]:
        for side, found in model["perspective_centres"].items():
            rays = pointing_rays(kept, model, side).values()
            assert len(rays) == 6
            squares = sum((x - found["X0"]) ** 2 + (y - found["Y0"]) ** 2 for x, y in rays)
            assert (squares / 9) ** 0.5 == pytest.approx(found["rms"], abs=1e-3)


def test_rays_that_do_not_give_the_rms_of_the_results_are_not_drawn(akwanga_folder, results):
    model = results["models"][0]
    found = model["perspective_centres"]["left"]
    other = model | {"perspective_centres": {"left": found | {"rms": found["rms"] + 0.01}}}
    assert pointing_rays(read_session(akwanga_folder), other, "left") == {}


def test_a_strip_by_comparator_and_readings_has_a_chapter_for_each_method(finished):
    page = Page(render_report(read_session(finished("a8-strip").folder)))
    text = "".join(page.text)
    for words in ("Strip, comparator", "Strip, A8", "A8 minus comparator"):
        assert words in text
    assert sum(tag == "svg" for tag, _ in page.elements) == 6
    assert not [table for table in page.tables if "Hours" in table.caption]


def test_a_grid_test_has_its_residuals_at_the_crosses(finished):
    page = Page(render_report(read_session(finished("grid test").folder)))
    titles = [table.caption for table in page.tables]
    assert "left projector" in titles and "right projector" in titles
    assert "Right projector: residuals at the crosses" in "".join(page.text)
    assert page.table("What gives this session again").row("command line")[1].endswith("--points 9 --levels 1")


def test_a_map_is_embedded_in_the_page_as_an_image(tmp_path, results):
    """The map is an image with its own data, so its styles do not apply to the rest of the page."""
    strip = results["strip"]
    line = {"name": "contour 460", "closed": True, "endings": [], "vertices": 9, "length_m": 80.0}
    document = {
        "schema_version": 1, "command": "compile", "scenario": "Akwanga", "seed": 7, "status": "complete",
        "message": "", "model": "1", "map_scale": 2500.0, "plan_gear": "1-2-1", "spot_heights": 5,
        "range_m": [440.0, 470.0], "expected": {"sigma_height_m": 0.05, "sigma_plan_m": 0.07},
        "levelling": {"rounds": 2, "tilt_left_gon": 0.01, "scale_found": 3750.0}
        | {key: strip[key] for key in ("absolute", "residuals_m", "accuracy_m", "warnings")},
        "lines": [line | {"rms_height_m": 0.051, "largest_height_m": 0.2}],
        "beside_the_truth": {"contours": None}, "operator": results["operator"], "truth": {"slips": []},
    }  # fmt: skip
    (tmp_path / "results.json").write_text(json.dumps(document), encoding="utf-8")
    drawn = '<svg xmlns="http://www.w3.org/2000/svg"><style>text { fill: red; }</style></svg>'
    (tmp_path / "map.svg").write_text(drawn, encoding="utf-8")
    text = render_report(read_session(tmp_path))
    page = Page(text)
    image = next(attributes for tag, attributes in page.elements if tag == "img")
    assert image["alt"] == "Map of model 1"
    assert base64.b64decode(image["src"].partition("base64,")[2]).decode() == drawn
    assert "fill: red" not in text
    assert page.table("Lines beside the true ground").row("contour 460")[4] == "0.051"
    assert "Levelling on the ground control: residuals in height" in "".join(page.text)


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (shutil.rmtree, "expected the folder of a session, got none"),
        (lambda folder: (folder / "results.json").unlink(), "the session was cut off before its end"),
        (lambda folder: (folder / "results.json").write_text("{"), "expected the results of a session in JSON"),
        (lambda folder: (folder / "results.json").write_text("[]"), "a document that names no command"),
        (
            lambda folder: (folder / "results.json").write_text('{"schema_version": 1, "command": "reduce strip"}'),
            "got those of reduce strip",
        ),
        (
            lambda folder: (folder / "results.json").write_text('{"schema_version": 2, "command": "run"}'),
            "expected schema_version 1, got 2",
        ),
        (
            lambda folder: (folder / "results.json").write_text('{"schema_version": 1, "command": "run"}'),
            "got some that lack or change a part",
        ),
        (lambda folder: (folder / "book.csv").write_text("a,b\n1,2\n"), "expected the columns number,time_s"),
    ],
)
def test_the_error_message_for_a_folder_that_is_no_session_is_one_sentence(
    akwanga_folder, tmp_path, typed, harm, words
):
    folder = tmp_path / "harmed"
    shutil.copytree(akwanga_folder, folder)
    harm(folder)
    code, printed, complaint = typed("report", folder, "--out", tmp_path / "r.html")
    assert (code, printed) == (2, "")
    assert words in complaint
    assert complaint.count("\n") == 1
    assert not (tmp_path / "r.html").exists()


def test_without_matplotlib_the_error_message_names_the_extra_to_install(akwanga_folder, tmp_path, typed, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, _, complaint = typed("report", akwanga_folder, "--out", tmp_path / "r.html")
    assert code == 2
    assert complaint == "a7sim: a report needs matplotlib for its figures, got none: pip install 'a7sim[report]'\n"


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium to open the page with")
def test_a_browser_opens_the_page_without_an_error_or_a_request(text, tmp_path):
    (tmp_path / "r.html").write_text(text, encoding="utf-8")
    seen = subprocess.run(
        [
            CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
            "--host-resolver-rules=MAP * ~NOTFOUND", "--enable-logging=stderr", "--v=0", "--window-size=400,900",
            "--dump-dom", (tmp_path / "r.html").as_uri(),
        ],
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    assert "CONSOLE" not in seen.stderr
    assert seen.stdout.count("<figure>") == text.count("<figure>")
