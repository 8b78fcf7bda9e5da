"""Rules of protocol.md that hold for every line and every setting, tried with lines and settings at random."""

import string

from hypothesis import given
from hypothesis import strategies as st

from a7sim.plotters import LEAST_COUNT, VARIANTS
from tests.support.engine_client import EngineClient
from tests.support.hypothesis_profile import examples
from tests.test_language import ELEMENTS, EXAMPLES, in_full, in_short

quick = examples(300)

LINES = [f"{form(header)} {value}" for header, value in EXAMPLES.items() for form in (in_short, in_full)]
"""A good line of every header, short and long."""


within_a_line = st.characters(max_codepoint=255, exclude_characters="\r\n")

within_a_unit = st.sampled_from([letter for letter in string.printable if letter not in "\r\n;\"'"])
"""Characters that neither end a unit nor protect the end of one."""


@st.composite
def mutated(draw, alphabet):
    """A good line with a few characters taken out, put in or changed."""
    line = list(draw(st.sampled_from(LINES)))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(line)))
        line[at : at + draw(st.integers(0, 2))] = draw(st.text(alphabet, max_size=2))
    return "".join(line)


def quotes_close(unit):
    return unit.count('"') % 2 == 0


received = st.lists(
    st.one_of(
        mutated(within_a_line).map(lambda line: line.encode("latin-1")),
        st.sampled_from([b"\n", b"\r", b"\r\n", b";", b";:", b"'", b'"', b" " * 4096, b"*OPC?\n", b"BASE:BX 5;BX?\n"]),
        st.binary(max_size=40),
    ),
    max_size=12,
).map(b"".join)


@quick
@given(received)
def test_no_bytes_raise_an_error(flood):
    client = EngineClient()
    client.feed(flood + b"\n")
    client.feed(b"\n*CLS\n")
    assert client.query("*OPC?") == "1"


@quick
@given(received, st.data())
def test_bytes_in_pieces_get_the_same_replies_as_at_once(flood, data):
    whole, pieces = EngineClient(), EngineClient()
    cuts = sorted(data.draw(st.lists(st.integers(0, len(flood)), max_size=8)))
    parts = [flood[start:end] for start, end in zip([0, *cuts], [*cuts, len(flood)], strict=True)]
    assert b"".join(map(pieces.feed, parts)) == whole.feed(flood)
    assert pieces.feed(b"\n") == whole.feed(b"\n")
    assert pieces.errors() == whole.errors()


@quick
@given(st.one_of(mutated(within_a_unit), st.text(within_a_unit, max_size=30), st.sampled_from(LINES)))
def test_a_query_gives_one_reply_or_one_error_and_a_command_no_reply(unit):
    client = EngineClient()
    reply = client.feed(unit.encode() + b"\n")
    errors = int(client.query("SYST:ERR:COUN?"))
    if unit.strip() and unit.split()[0].endswith("?"):
        assert (reply.endswith(b"\n"), errors) in ((True, 0), (False, 1))
    else:
        assert reply == b""
        assert errors <= 1
    assert all(";" in each for each in client.engine.errors), "an error says what was expected or what came"


@quick
@given(st.lists(st.one_of(mutated(within_a_unit).filter(quotes_close), st.sampled_from(LINES)), max_size=6))
def test_units_of_one_line_answer_as_on_lines_of_their_own_joined_by_semicolons(units):
    together, apart = EngineClient(), EngineClient()
    rooted = [unit if unit.lstrip().startswith("*") else f":{unit.lstrip().lstrip(':')}" for unit in units]
    replies = [apart.feed(unit.encode() + b"\n").removesuffix(b"\n") for unit in rooted]
    expected = b";".join(reply for reply in replies if reply)
    assert together.feed(";".join(rooted).encode() + b"\n").removesuffix(b"\n") == expected
    assert together.errors() == apart.errors()


@quick
@given(st.sampled_from(list(ELEMENTS.items())), st.floats(0.0, 1.0))
def test_an_element_reads_back_within_half_a_least_count_and_in_its_range(named, share):
    header, name = named
    element = VARIANTS["A7"].elements[name]
    value = element.low + share * (element.high - element.low)
    client = EngineClient()
    shown = client.numbers(f"{header} {value!r};:{header}?")[0]
    difference = abs(shown - value)
    if element.endless:
        difference = min(difference, element.high - difference)
    assert difference <= LEAST_COUNT / 2.0 + 1e-9
    assert element.low <= shown <= element.high
    assert client.errors() == []


@quick
@given(st.sampled_from(list(ELEMENTS.items())), st.floats(0.01, 1e6), st.booleans())
def test_beyond_its_range_an_element_stays_where_it_is(named, excess, above):
    header, name = named
    element = VARIANTS["A7"].elements[name]
    client = EngineClient()
    before = client.query(f"{header}?")
    assert client.query(f"{header} {element.high + excess if above else element.low - excess!r};:{header}?") == before
    assert client.errors() == [-222]


@quick
@given(st.sampled_from("XYZ"), st.floats(-999999.0, 999999.0), st.floats(-100.0, 100.0))
def test_a_counter_reads_what_it_was_preset_and_then_what_it_was_turned(axis, reading, amount):
    client = EngineClient()
    shown = client.numbers(f"COUN:{axis}:PRES {reading!r};:COUN:{axis}?")[0]
    assert abs(shown - reading) <= LEAST_COUNT / 2.0 + 1e-6
    turned = client.numbers(f"WHE:{axis} {amount!r};:COUN:{axis}?")[0]
    assert abs(turned - shown - amount) <= LEAST_COUNT / 2.0 + 1e-6
    assert client.errors() == []


@quick
@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=60), st.sampled_from("\"'"))
def test_any_printable_text_comes_back_from_its_quotes(text, quote):
    client = EngineClient()
    inner = text.replace('"', '""')
    assert (
        client.query(f"REC {quote}{text.replace(quote, quote * 2)}{quote};:REC:LAST?")
        == f'1,"{inner}",0.00,0.00,-300.00'
    )
