"""Cards of the N.R.C. strip program: written cards can be read, and error messages name a bad card."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim.errors import A7SimError
from a7sim.reduction.absolute import Ground, absolute_orientation
from a7sim.reduction.cards import deck_lines, free_format_lines, is_deck, output_lines, read_cards, write_cards
from a7sim.reduction.strips import Model, formed_strip, is_centre
from tests.support.hypothesis_profile import examples

DECK = """\
      101 1000.000 2000.000  100.000
      102 1500.000 2000.000  110.000
      103 1500.000 1500.000  120.000
  -1
   1  101   10.000   20.000    1.000
   2  103   40.000  -20.000   -1.000
  -2
   1   28   25.000    0.000   30.000
   1  102   25.000   20.000    0.500
   1    7   26.000  -20.000    0.250
  -2
   2   28    0.000    0.000   30.000
   2  102    0.000   20.000    0.500
   2    7    1.000  -20.000    0.250
"""


def deck(tmp_path, text=DECK):
    path = tmp_path / "aba.txt"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_deck_is_read_by_its_columns(tmp_path):
    found = read_cards(deck(tmp_path))
    assert found.ground.points == ("101", "102", "103")
    assert found.ground.roles == ("control",) * 3
    np.testing.assert_array_equal(found.ground.coordinates[:, 2], [1500.0, 1500.0, 120.0])
    assert [model.name for model in found.models] == ["1", "2"]
    assert found.models[0].points == ("101", "28:centre", "102", "7")
    np.testing.assert_array_equal(found.models[1].at(["28:centre"])[:, 0], [0.0, 0.0, 30.0])


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("aba.txt", DECK, True),
        ("aba", "\n" + DECK, True),
        ("aba.crd", "model,point,X,Y,Z\n", True),
        ("ABA.CARDS", "", True),
        ("aba.csv", DECK, False),
        ("aba.txt", "# one\nmodel,point,X,Y,Z\n1,2,3,4,5\n", False),
        ("aba.txt", "[[rows]]\nX = 1\n", False),
        ("aba.txt", "", False),
    ],
)
def test_a_deck_is_recognised_by_its_file_name_or_its_content(name, text, expected):
    assert is_deck(name, text) is expected


def test_written_cards_equal_the_cards_read(tmp_path):
    found = read_cards(deck(tmp_path))
    lines = deck_lines(found.ground, found.models)
    write_cards(tmp_path / "again.txt", lines)
    assert sorted((tmp_path / "again.txt").read_text().splitlines()) == sorted(DECK.splitlines())


def strip_of(rng, photographs):
    places = {str(100 + 10 * i + k): np.array([i * 90.0, y, 0.0]) + rng.uniform(-5, 5, 3) for i in range(photographs)
              for k, y in enumerate((80.0, 0.0, -80.0, 40.0))}  # fmt: skip
    centres = {f"{i + 1}:centre": np.array([i * 90.0, 0.0, 150.0]) for i in range(photographs)}
    models = []
    for i in range(photographs - 1):
        names = [name for name in places if (int(name) - 100) // 10 in (i, i + 1)]
        names += [f"{i + 1}:centre", f"{i + 2}:centre"]
        true = np.array([{**places, **centres}[name] for name in names]).T
        models.append(Model(str(i + 1), tuple(names), true * rng.uniform(0.9, 1.1) + rng.uniform(-9, 9, (3, 1))))
    names = tuple(places)
    ground = np.array([places[name] * 5.0 + (700.0, 500.0, 90.0) for name in names]).T
    roles = tuple("control" if name[-1] in "02" else "check" for name in names)
    return models, Ground(names, ground, roles)


@examples(30)
@given(st.integers(0, 2**32 - 1))
def test_strips_of_any_length_survive_cards_in_any_order(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    models, ground = strip_of(rng, int(rng.integers(2, 6)))
    lines = deck_lines(ground, models)
    sections, section = [], []
    for line in lines:
        if line in ("  -1", "  -2"):
            sections.append(section)
            section = [line]
        else:
            section.append(line)
    sections.append(section)
    shuffled = []
    for section in sections:
        fixed = 2 if section and section[0] == "  -2" else 1 if section and section[0] == "  -1" else 0
        shuffled += section[:fixed] + [section[fixed + i] for i in rng.permutation(len(section) - fixed)]
    path = tmp_path_factory.mktemp("cards") / "aba.txt"
    residuals = []
    for each in (lines, shuffled):
        write_cards(path, each)
        found = read_cards(path)
        for model in found.models:
            original = next(m for m in models if m.name == model.name)
            assert set(model.points) <= set(original.points)
            np.testing.assert_allclose(model.coordinates, original.at(model.points), atol=5.1e-4)
            assert all(is_centre(name) for name in set(original.points) - set(model.points))
        fit = absolute_orientation(formed_strip(found.models), found.ground).fit
        residuals.append(fit.residuals)
    np.testing.assert_allclose(residuals[0], residuals[1], atol=1e-8)
    assert np.abs(residuals[0]).max() < 0.05


def test_output_cards_have_residuals_at_control_and_deviations_at_ties(tmp_path):
    rng = np.random.default_rng(6)
    models, ground = strip_of(rng, 3)
    models = [Model(m.name, m.points, m.coordinates + 0.05 * rng.standard_normal(m.coordinates.shape)) for m in models]
    strip = formed_strip(models)
    found = absolute_orientation(strip, ground)
    in_ground = strip.transformed(found.similarity)
    lines = output_lines(ground, in_ground)
    write_cards(tmp_path / "paq.txt", lines)
    read = read_cards(tmp_path / "paq.txt")
    assert [model.name for model in read.models] == ["1", "2"]
    by_card = {(line[:4].strip(), line[4:9].strip()): line for line in lines if len(line) == 63}
    place = found.fit.ground.points.index("100")
    printed = [float(by_card["", "100"][first : first + 9]) for first in (36, 45, 54)]
    np.testing.assert_allclose(printed, found.fit.residuals[:, place], atol=5.1e-4)
    tie = [[float(by_card[model, "111"][first : first + 9]) for first in (36, 45, 54)] for model in ("1", "2")]
    np.testing.assert_allclose(tie[0], -np.array(tie[1]), atol=1.1e-3)
    deviation = in_ground.deviations(in_ground.models[1])[:, in_ground.models[1].points.index("111")]
    np.testing.assert_allclose(tie[1], deviation, atol=5.1e-4)


CARDS = [i for i, line in enumerate(DECK.splitlines()) if len(line) == 36]


@pytest.mark.parametrize("card", CARDS)
@pytest.mark.parametrize("off", ["right", "left"])
def test_a_card_one_column_off_is_found(tmp_path, card, off):
    lines = DECK.splitlines()
    lines[card] = " " + lines[card] if off == "right" else lines[card][1:]
    with pytest.raises(A7SimError, match=rf"aba\.txt, line {card + 1}, columns? \d+"):
        read_cards(deck(tmp_path, "\n".join(lines) + "\n"))


@pytest.mark.parametrize("off", ["right", "left"])
def test_a_full_card_one_column_off_is_found_although_every_field_is_a_number(tmp_path, off):
    full = "   112271" + "12345.678" + "23456.789" + "34567.891"
    lines = DECK.splitlines()
    lines[4] = " " + full if off == "right" else full[1:]
    with pytest.raises(A7SimError, match=r"line 5, columns? \d+"):
        read_cards(deck(tmp_path, "\n".join(lines) + "\n"))


@pytest.mark.parametrize("off", [" ", ""])
def test_a_section_card_off_its_columns_is_found(tmp_path, off):
    text = DECK.replace("  -2\n", f"{off}  -2\n" if off else " -2\n", 1)
    with pytest.raises(A7SimError, match="line 7, column"):
        read_cards(deck(tmp_path, text))


def test_blank_cards_are_skipped(tmp_path):
    spaced = deck_lines_of(read_cards(deck(tmp_path, DECK.replace("\n", "\n\n"))))
    assert spaced == deck_lines_of(read_cards(deck(tmp_path)))


def deck_lines_of(read):
    return deck_lines(read.ground, read.models)


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ("      102 1500.000", "      102 15OO.000", "line 2, columns 10-18"),
        ("      102 1500.000", "      10A 1500.000", "line 2, columns 5-9"),
        ("      102 1500.000", "      102     1500", "line 2, columns 10-18"),
        ("      102 1500.000", "      102         ", "line 2, columns 10-18"),
        ("      102 1500.000", "      101 1500.000", "line 2, columns 5-9"),
        ("      102 1500.000", "   1  102 1500.000", "line 2, columns 1-4"),
        ("      102 1500.000", "\t     102 1500.000", "line 2, column 1"),
        ("      102 1500.000", "      102 15é0.000", "line 2, column 13"),
        ("   2  103", "      103", "line 6, columns 1-4"),
        ("   2  103", "  -3  103", "line 6, columns 1-4"),
        ("   1  102   25", "   2  102   25", "line 9, columns 1-4"),
        ("   2   28", "   2   29", "line 12, columns 5-9"),
        ("   2   28    0.000", "   1   28    0.000", "line 12, columns"),
        ("   2    7", "   2    8", "line 10, columns 5-9"),
        ("  -1\n", "", "line 6, columns 1-4"),
        ("  -1\n", "  -2\n", "line 4, columns 1-4"),
        ("  -1\n", "  -1    1\n", "line 4, column 5"),
        ("   7   26.000", "   102   26.000", "line 10, column"),
        ("  -2\n", "  -2\n  -2\n", "line 8: expected a centre and tie points after the card"),
        (DECK.splitlines()[0], DECK.splitlines()[0] + " " * 60 + "1", "line 1, column"),
        (
            "".join(DECK.splitlines(keepends=True)[11:]),
            "".join(DECK.splitlines(keepends=True)[7:10]),
            "line 12, columns 1-4: expected the next model, got 1 again",
        ),
    ],
)
def test_an_error_message_names_file_line_and_column_of_a_bad_card(tmp_path, old, new, where):
    assert old in DECK
    with pytest.raises(A7SimError) as caught:
        read_cards(deck(tmp_path, DECK.replace(old, new, 1)))
    assert f"aba.txt, {where}" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "expected" in str(caught.value)


def test_a_file_that_is_no_deck_is_refused(tmp_path):
    lines = DECK.splitlines(keepends=True)
    for text in ("", "\n\n", "".join(lines[:3]), "".join(lines[:4]), "".join(lines[:10]), "".join(lines[:11])):
        with pytest.raises(A7SimError, match=r"aba\.txt"):
            read_cards(deck(tmp_path, text))
    with pytest.raises(A7SimError, match="readable"):
        read_cards(tmp_path / "none.txt")
    noise = tmp_path / "noise.txt"
    with noise.open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(A7SimError, match="at most"):
        read_cards(noise)
    (tmp_path / "bytes.txt").write_bytes(np.random.default_rng(0).bytes(5000))
    with pytest.raises(A7SimError, match=r"bytes\.txt, line \d+, column \d+"):
        read_cards(tmp_path / "bytes.txt")


def without_centres(model):
    for centre in model.centres:
        model = model.without(centre)
    return model


def test_a_value_that_does_not_fit_a_card_is_refused():
    models, ground = strip_of(np.random.default_rng(1), 2)
    with pytest.raises(A7SimError, match="nine columns"):
        deck_lines(Ground(("1",), np.array([[4505079.577], [0.0], [0.0]]), ("control",)), models)
    with pytest.raises(A7SimError, match="at most 5 digits"):
        deck_lines(Ground(("8031901",), np.zeros((3, 1)), ("control",)), models)
    named = Model("left", models[0].points, models[0].coordinates)
    with pytest.raises(A7SimError, match="at most 4 digits"):
        deck_lines(ground, [named])
    with pytest.raises(A7SimError, match=r"expected one common projection centre \(<photo>:centre\)"):
        deck_lines(ground, [without_centres(model) for model in strip_of(np.random.default_rng(1), 3)[0]])


def test_free_format_models_end_with_minus_99():
    lines = free_format_lines([Model("12", ("3:centre", "101"), np.array([[0.0, 1.5], [0.0, 2.0], [150.0, -0.25]]))])
    assert lines == ["12", "3 0.0000 0.0000 150.0000", "101 1.5000 2.0000 -0.2500", "-99"]
    with pytest.raises(A7SimError, match="number of its own"):
        free_format_lines([Model("12", ("3:centre", "3"), np.zeros((3, 2)))])
