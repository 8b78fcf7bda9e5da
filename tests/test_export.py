"""Export of a session as asciicast, printed forms and cards; comparison of sessions."""

import csv
import json
import shutil

import pytest

from a7sim.report.forms import make_forms
from a7sim.report.session_folder import read_session


@pytest.fixture(scope="module")
def results(akwanga_folder):
    return json.loads((akwanga_folder / "results.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def book(akwanga_folder):
    with (akwanga_folder / "book.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


# --- the asciicast ------------------------------------------------------------------------------------


@pytest.fixture
def asciicast(akwanga_folder, typed):
    code, printed, _ = typed("export", akwanga_folder, "--to", "asciicast", "--speed", 100)
    assert code == 0
    return [json.loads(line) for line in printed.splitlines()]


def test_a_session_is_exported_as_asciicast_of_version_2(asciicast):
    """Header, then events [time, code, text] with times in order (docs.asciinema.org, asciicast v2)."""
    header, *events = asciicast
    assert header["version"] == 2
    assert header["width"] > 0 and header["height"] > 0
    times = [time for time, code, text in events]
    assert times == sorted(times)
    assert header["duration"] == times[-1]
    assert {code for _, code, _ in events} == {"o", "m"}
    assert all("\n" not in text.replace("\r\n", "") for _, _, text in events)


def test_an_asciicast_has_a_marker_at_every_form_of_every_model(asciicast, book):
    forms = {f"{row['model']}: {row['form']}" for row in book}
    rounds = {f"{row['model']}: {row['form']}, round {row['round']}" for row in book if row["round"]}
    marked = [text for _, code, text in asciicast[1:] if code == "m"]
    assert set(marked) == forms | rounds
    assert len(marked) == len(set(marked))


def test_an_asciicast_shows_every_reading_at_its_time(asciicast, book):
    shown = [(time, text) for time, code, text in asciicast[1:] if code == "o"]
    for row in book[:: len(book) // 20]:
        time = float(row["time_s"]) / 100.0
        assert any(at == pytest.approx(time, abs=1e-5) and row["reading"] in text for at, text in shown)


def test_an_asciicast_shows_each_table_after_its_model_and_the_strip_at_the_end(asciicast, results):
    text_at = {time: text for time, code, text in asciicast[1:] if code == "o"}
    for model in results["models"]:
        assert f"Model {model['model']}: " in text_at[round(model["finished_at_s"] / 100.0, 6)]
    assert "Accuracy" in asciicast[-1][2]
    assert asciicast[1][2] == "$ a7sim run akwanga --seed 7\r\n"


def test_an_incomplete_last_line_of_the_journal_is_ignored_and_other_damage_reported(akwanga_folder, tmp_path, typed):
    copy = tmp_path / "torn"
    shutil.copytree(akwanga_folder, copy)
    journal = copy / "session.jsonl"
    whole = journal.read_bytes()
    journal.write_bytes(whole[:-20])
    assert typed("export", copy, "--to", "asciicast")[0] == 0
    lines = whole.splitlines(keepends=True)
    journal.write_bytes(b"".join([*lines[:99], b'{"t":1.0,"cli\n', *lines[100:]]))
    code, _, error = typed("export", copy, "--to", "asciicast")
    assert code == 2
    assert "session.jsonl, line 100: expected the checksum that follows from the lines before and this one" in error


# --- the book and its forms ---------------------------------------------------------------------------


def test_the_exported_book_equals_the_book_of_the_session(akwanga_folder, tmp_path, typed):
    out = tmp_path / "book.csv"
    assert typed("export", akwanga_folder, "--to", "book", "--out", out) == (0, f"{out}\n", "")
    assert out.read_bytes() == (akwanga_folder / "book.csv").read_bytes()


def test_each_form_has_its_own_page_and_a_title_of_the_thesis(akwanga_folder, typed):
    code, printed, _ = typed("export", akwanga_folder, "--to", "forms")
    assert code == 0
    pages = printed.split("\f")
    assert len(pages) == len(list(make_forms(read_session(akwanga_folder))))
    for title, number in (
        ("FORM FOR NUMERICAL RELATIVE ORIENTATION", 4),
        ("FORM FOR RECORDING MODEL COORDINATES", 2),
        ("FORM FOR PERSPECTIVE-CENTRE POSITION DETERMINATION", 4),
    ):
        assert sum(page.startswith(title) for page in pages) >= number
    assert max(map(len, printed.splitlines())) <= 132


def test_every_reading_is_on_the_forms_once(akwanga_folder, book):
    forms = list(make_forms(read_session(akwanga_folder)))
    on_forms = sorted(
        cell for form in forms for column in form.columns[1:] if column.which not in ("mean",) and column.item != "p"
        for cell in column.cells if cell
    )  # fmt: skip
    assert on_forms == sorted(row["reading"] for row in book if row["point"] and row["reading"] and not row["struck"])
    struck = [line for form in forms for line in form.foot if line.startswith("struck out: ")]
    assert len(struck) == sum(bool(row["struck"]) for row in book)


def test_parallaxes_on_the_forms_equal_those_of_the_results(akwanga_folder, results):
    """A parallax is half of by' minus by" (thesis); form and results agree."""
    form = next(form for form in make_forms(read_session(akwanga_folder)) if "relative" in form.caption)
    points, p = form.columns[0].cells, form.columns[-1].cells
    by1, by2 = ([float(cell) for cell in column.cells] for column in form.columns if column.which == "mean")
    model = results["models"][0]
    parallaxes = model["relative_orientation"]["rounds"][0]["parallax_mm"]
    name = {point: label for label, point in model["standard_points"].items()}
    for i, point in enumerate(points):
        assert p[i] == f"{parallaxes[name[point]]:+.3f}"
        assert (by1[i] - by2[i]) / 2.0 == pytest.approx(parallaxes[name[point]], abs=1e-3)


def test_perspective_centres_are_in_the_foot_of_their_forms(akwanga_folder, results):
    forms = [form for form in make_forms(read_session(akwanga_folder)) if "left perspective centre" in form.caption]
    for form, model in zip(forms, results["models"], strict=True):
        centre = model["perspective_centres"]["left"]
        assert f"Z0 = {centre['Z0']:.3f} ± {centre['sigma_Z0']:.3f}" in form.foot


# --- cards --------------------------------------------------------------------------------------------


def test_missing_cards_are_made_again_with_the_same_content(akwanga_folder, tmp_path, typed):
    deck = (akwanga_folder / "strip.crd").read_text(encoding="utf-8")
    assert typed("export", akwanga_folder, "--to", "cards") == (0, deck, "")
    copy = tmp_path / "without"
    shutil.copytree(akwanga_folder, copy)
    (copy / "strip.crd").unlink()
    assert typed("export", copy, "--to", "cards") == (0, deck, "")


def test_cards_of_a_session_without_a_strip_are_refused(gave_up_folder, typed):
    code, _, error = typed("export", gave_up_folder, "--to", "cards")
    assert code == 2
    assert "expected a session with a strip on the ground, got one without" in error


def test_cards_of_a_strip_with_several_methods_need_an_option(finished, typed):
    out = finished("a8-strip").folder
    code, printed, _ = typed("export", out, "--to", "cards", "--method", "A8")
    assert code == 0
    assert len(printed.splitlines()) > 100
    code, _, error = typed("export", out, "--to", "cards")
    assert code == 2 and "(--method comparator or A8 has one)" in error
    code, _, error = typed("export", out, "--to", "cards", "--method", "A9")
    assert code == 2 and "(comparator, A8), got A9" in error
    code, _, error = typed("export", out, "--to", "asciicast")
    assert code == 2 and "expected the journal or the book of an operator" in error
    code, _, error = typed("export", out, "--to", "forms")
    assert code == 2 and "expected an observation book with entries, got none" in error


def test_an_option_of_another_format_is_refused(akwanga_folder, typed):
    code, _, error = typed("export", akwanga_folder, "--to", "book", "--speed", 3)
    assert (code, error) == (2, "a7sim: --speed: expected only with --to asciicast, got it with --to book\n")


# --- compare ------------------------------------------------------------------------------------------


def test_equal_sessions_have_no_differences(akwanga_folder, typed):
    code, printed, _ = typed("compare", akwanga_folder, akwanga_folder)
    assert code == 0
    assert printed.strip().endswith("all the same")
    document = json.loads(typed("compare", akwanga_folder, akwanga_folder, "--json")[1])
    assert document["rows"] == []


def test_differences_are_listed_with_the_values_of_the_results(akwanga_folder, results, tmp_path, typed):
    """The rows are exactly the changed facts, with the values of the results."""
    other = json.loads(json.dumps(results))
    other["seed"] = 8
    other["models"][1]["relative_orientation"]["elements"]["kappa1"] += 0.01
    other["strip"]["accuracy_m"]["checks"]["plan"] = 0.25
    other["operator"]["time_by_activity_h"]["breaks"] = 0.5
    other["truth"]["slips"] = [*other["truth"]["slips"], {"kind": "invented"}]
    copy = tmp_path / "other"
    shutil.copytree(akwanga_folder, copy)
    (copy / "results.json").write_text(json.dumps(other), encoding="utf-8")
    document = json.loads(typed("compare", akwanga_folder, copy, "--json")[1])
    assert document["sessions"] == [str(akwanga_folder), str(copy)]
    slips = len(results["truth"]["slips"])
    assert {row["fact"]: row["values"] for row in document["rows"]} == {
        "seed": ["7", "8"],
        "models.2.relative_orientation.elements.kappa1": [
            json.dumps(each["models"][1]["relative_orientation"]["elements"]["kappa1"]) for each in (results, other)
        ],
        "strip.accuracy_m.checks.plan": [json.dumps(results["strip"]["accuracy_m"]["checks"]["plan"]), "0.25"],
        "operator.time_by_activity_h.breaks": ["-", "0.5"],
        "truth.slips": [str(slips), str(slips + 1)],
        "truth.slips.invented": ["-", "1"],
    }
    printed = typed("compare", akwanga_folder, copy)[1]
    assert "6 differences" in printed
    assert "models 2 relative_orientation elements" in printed
    everything = json.loads(typed("compare", akwanga_folder, copy, "--json", "--all")[1])["rows"]
    assert ["Akwanga", "Akwanga"] in [row["values"] for row in everything]
    assert len(everything) > 100


def test_sessions_that_ended_differently_can_be_compared(akwanga_folder, gave_up_folder, typed):
    rows = {
        row["fact"]: row["values"]
        for row in json.loads(typed("compare", akwanga_folder, gave_up_folder, "--json")[1])["rows"]
    }
    assert rows["status"] == ["complete", "does not fit"]
    assert rows["settings.photos.1.laid"] == ["-", "upside down"]
    assert rows["models.1.perspective_centres.left.X0"][1] == "-"


def test_a_wrong_comparison_is_reported_in_one_sentence(akwanga_folder, tmp_path, typed):
    other = tmp_path / "grid"
    other.mkdir()
    (other / "results.json").write_text('{"schema_version": 1, "command": "calibrate"}', encoding="utf-8")
    for words, message in (
        ((akwanga_folder,), "expected two folders of sessions or more, got one"),
        ((akwanga_folder, other), "expected sessions of one kind to compare, got several"),
        ((akwanga_folder, tmp_path), "expected the folder of a session with its results.json, got none"),
    ):
        code, printed, error = typed("compare", *words)
        assert (code, printed) == (2, "")
        assert message in error
        assert error.count("\n") == 1
