"""Movement lasts (issue 5): `*OPC?`, `*WAI`, `*OPC` and the operation bits follow the simulated clock, no wire between.

SCPI-1999 20.1.4 for SETTling, IEEE 488.2 12.5 for the operation complete commands.
"""

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from a7sim.instrument import Autograph
from a7sim.instrument.language import MAX_BUFFERED_BYTES, SharedInstrument
from a7sim.instrument.language.shared_instrument import POLL_SECONDS
from a7sim.link.clock import Clock
from a7sim.link.inprocess import InProcessSerial
from a7sim.plotters import VARIANTS, Rates
from tests.support.engine_client import EngineClient, with_photographs

RATES = Rates()


@pytest.fixture
def instrument():
    return SharedInstrument(Autograph(VARIANTS["A7"]), poll_takes=0.0)


@pytest.fixture
def engine(instrument):
    return instrument.open()


@pytest.mark.parametrize(
    ("line", "seconds"),
    [
        ("DRIV:X 50", 50.0 / RATES.carriage),
        ("WHE:Y -20", 20.0 / RATES.carriage),
        ("GEAR:HEIG 8", RATES.gear),
        ("DRIV:Z -310", 10.0 / RATES.carriage),
        ("PROJ1:KAPP 3", 3.0 / RATES.angle),
        ("PROJ1:KAPP 399", 1.0 / RATES.angle),
        ("PROJ2:OMEG 98", 2.0 / RATES.angle),
        ("PROJ1:BY -5", 5.0 / RATES.length),
        ("PROJ1:PDIS 152", 2.0 / RATES.length),
        ("BASE:BX 190", 190.0 / RATES.length),
        ("BASE:MODE OUT", RATES.lever),
        ("BASE:MODE IN", 0.0),
        ("FITT:DOVE IN", RATES.lever),
        ("COUN:X:PRES 100", 0.0),
        ("COUN?;:BASE:BX?", 0.0),
        ("DRIV:X 1000", 0.0),
    ],
)
def test_a_movement_lasts_by_how_far_it_goes(instrument, engine, line, seconds):
    engine.feed(line.encode() + b"\n", 100.0)
    assert max(instrument.busy_until - 100.0, 0.0) == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("line", "seconds"),
    [
        ('PHOT1:LOAD "101"', RATES.laying),
        ("PHOT2:CENT 3,4,0", 5.0 / RATES.length),
        ("PHOT2:CENT 0,0,-6", 6.0 / RATES.angle),
        ("PHOT2:UNL", RATES.laying),
    ],
)
def test_pictures_take_their_time(line, seconds):
    client = with_photographs()
    client.engine.feed(b'PHOT2:LOAD "102"\n', 0.0)
    client.engine.feed(line.encode() + b"\n", 100.0)
    assert client.instrument.busy_until - 100.0 == pytest.approx(seconds)


def test_parts_move_at_the_same_time_and_each_does_one_thing_after_the_other(instrument, engine):
    engine.feed(b"DRIV:X 50;Y 20\n", 0.0)
    assert instrument.busy_until == 5.0
    engine.feed(b"DRIV:Y -40\n", 1.0)
    assert instrument.busy_until == 2.0 + 6.0
    engine.feed(b"DRIV:X 0\n", 20.0)
    assert (instrument.busy_since, instrument.busy_until) == (20.0, 25.0)


def test_reset_lasts_as_long_as_the_element_that_has_furthest_to_go(instrument, engine):
    engine.feed(b"BASE:BX 100;:PROJ1:KAPP 12;OMEG 95\n", 0.0)
    engine.feed(b"*RST\n", 1000.0)
    assert instrument.busy_until == pytest.approx(1000.0 + 100.0 / RATES.length)


def test_what_is_read_while_something_moves_is_what_stands_at_the_end(engine):
    assert engine.feed(b"DRIV:X 50;:COUN:X?\n", 0.0) == b"50.00\n"


def test_opc_answers_when_all_movement_is_done_and_holds_back_what_follows(engine):
    assert engine.feed(b"DRIV:X 50\nCOUN:X?;*OPC?;Y?\n*TST?\n*TS", 0.0) == b""
    assert engine.waits_until == 5.0
    assert engine.feed(b"T?\n", 3.0) == b""
    assert engine.feed(b"", 4.99) == b""
    assert engine.feed(b"", 5.0) == b"50.00;1;0.00\n0\n0\n"
    assert engine.waits_until is None


def test_opc_answers_at_once_where_nothing_moves(engine):
    assert engine.feed(b"*OPC?\n", 0.0) == b"1\n"
    engine.feed(b"DRIV:X 50\n", 0.0)
    assert engine.feed(b"*OPC?\n", 5.0) == b"1\n"


def test_wai_lets_the_next_unit_begin_when_the_movement_is_done(instrument, engine):
    engine.feed(b"DRIV:X 50;*WAI;X 0;*WAI;X 10\n", 0.0)
    assert (engine.waits_until, instrument.busy_until) == (5.0, 5.0)
    engine.feed(b"", 5.0)
    assert engine.waits_until == 10.0
    engine.feed(b"", 10.0)
    assert (engine.waits_until, instrument.busy_until) == (None, 11.0)


def test_a_wait_that_ends_late_continues_from_its_end(instrument, engine):
    engine.feed(b"DRIV:X 50;*WAI;X 0\n", 0.0)
    engine.feed(b"", 7.5)
    assert instrument.busy_until == 12.5


def test_a_waiting_client_does_not_wait_for_later_movements_of_other_clients(instrument, engine):
    other = instrument.open()
    engine.feed(b"DRIV:X 50;*OPC?\n", 0.0)
    other.feed(b"DRIV:X -200\n", 1.0)
    assert instrument.busy_until == 30.0
    assert engine.feed(b"", 5.0) == b"1\n"


def test_other_clients_continue_while_one_waits(instrument, engine):
    other = instrument.open()
    engine.feed(b"DRIV:X 50;*WAI\n", 0.0)
    assert other.feed(b"COUN:X?\n", 0.1) == b"50.00\n"


def test_opc_without_a_question_mark_raises_its_bit_when_the_movement_is_done(engine):
    assert engine.feed(b"*CLS;DRIV:X 50;*OPC;*ESR?\n", 0.0) == b"0\n"
    assert engine.feed(b"*ESR?\n", 4.99) == b"0\n"
    assert engine.feed(b"*ESE 1;*SRE 32;*STB?;*ESR?;*ESR?\n", 5.0) == b"96;1;0\n"


@pytest.mark.parametrize("forgotten_by", ["*CLS", "*RST"])
def test_cls_and_rst_forget_an_opc(engine, forgotten_by):
    engine.feed(b"*CLS;DRIV:X 50;*OPC;" + forgotten_by.encode() + b"\n", 0.0)
    assert engine.feed(b"*ESR?\n", 100.0) == b"0\n"


def test_bit_1_of_the_operation_register_follows_the_movement(engine):
    assert engine.feed(b"STAT:OPER:COND?;EVEN?\n", 0.0) == b"0;0\n"
    assert engine.feed(b"DRIV:X 50;:STAT:OPER:COND?;EVEN?;EVEN?\n", 0.0) == b"2;2;0\n"
    assert engine.feed(b"STAT:OPER:COND?\n", 4.99) == b"2\n"
    assert engine.feed(b"STAT:OPER:COND?;EVEN?\n", 5.0) == b"0;0\n"


def test_a_movement_that_came_and_went_unseen_is_an_event(instrument, engine):
    instrument.open().feed(b"DRIV:X 50\n", 0.0)
    assert engine.feed(b"STAT:OPER:COND?;EVEN?;ENAB 2;*STB?\n", 50.0) == b"0;2;0\n"
    instrument.open().feed(b"DRIV:X 0\n", 60.0)
    assert engine.feed(b"*STB?;*CLS;*STB?;:STAT:OPER?\n", 70.0) == b"128;0;0\n"


@pytest.mark.parametrize("query", ["*ESR?", "*STB?", "STAT:OPER:COND?", "STAT:OPER?"])
def test_polling_the_status_advances_the_time(query):
    clock = Clock()
    with InProcessSerial(instrument=SharedInstrument(Autograph(VARIANTS["A7"])), clock=clock, timeout=0.1) as port:
        port.write(b"*CLS;DRIV:X 5;*OPC\n")
        assert clock.now == 0.0
        port.write(query.encode() + b"\n")
        assert (len(port.readline()), clock.now) == (2, POLL_SECONDS)
        for _ in range(8):
            port.write(query.encode() + b"\n")
        port.write(b"*ESR?;*ESR?\n")
        assert clock.now == pytest.approx(0.5)


def test_looking_takes_no_time_where_nothing_moves_or_the_clock_goes_by_itself(engine):
    clock = Clock()
    with InProcessSerial(instrument=SharedInstrument(Autograph(VARIANTS["A7"])), clock=clock) as port:
        port.write(b"*ESR?;*STB?\n")
    assert clock.now == 0.0
    engine.feed(b"DRIV:X 50;*ESR?\n", 0.0)
    assert engine.waits_until is None


def test_in_process_nothing_ever_blocks_and_the_clock_runs_on():
    with serial.serial_for_url("a7sim://akwanga?seed=7", timeout=5) as port:
        for line, time in (
            (b"BASE:BX 100;*OPC?;:COUN:X?\n", 50.0),
            (b"*OPC?;DRIV:X 50;*OPC?\n", 55.0),
            (b"DRIV:X 0;*WAI;X 50;*OPC?\n", 65.0),
        ):
            port.write(line)
            assert port.readline().startswith(b"1")
            assert port.clock.now == pytest.approx(time)


def test_a_flood_in_process_is_obeyed_to_its_end(engine):
    lines = b"DRIV:X 10;*WAI;X 0;*OPC?\n" * 6000
    assert len(lines) > 2 * MAX_BUFFERED_BYTES
    with InProcessSerial(instrument=engine.instrument, timeout=1) as port:
        port.write(lines)
        assert port.in_waiting == 2 * 6000
        port.write(b"SYST:ERR:COUN?\n")
        assert port.read(2 * 6000 + 2)[-2:] == b"0\n"


def test_kept_input_is_bounded_and_its_loss_is_reported_once(engine):
    engine.feed(b"*CLS;DRIV:X 50;*WAI\n", 0.0)
    for _ in range(50):
        engine.feed(b"COUN:X?\n" * 1000, 1.0)
    assert engine.feed(b"*TST?\nCOUN", 2.0) == b""
    held = engine.feed(b"", 5.0)
    assert held == b"50.00\n" * (MAX_BUFFERED_BYTES // 8)
    assert engine.feed(b":X?\nCOUN:X?;:SYST:ERR:COUN?;:SYST:ERR?\n", 6.0).startswith(b"50.00;1;-363,")


def test_a_line_is_not_lost_behind_a_wait_that_keeps_less_than_the_bound(engine):
    engine.feed(b"DRIV:X 50;*WAI\n", 0.0)
    engine.feed(b"NOTE '" + b"x" * 1000 + b"'\nCOUN:", 1.0)
    engine.feed(b"", 5.0)
    assert engine.feed(b"X?;:SYST:ERR?\n", 5.0) == b'50.00;0,"No error"\n'


@pytest.mark.parametrize("line", [b"*RST;" * 200, b"EYEP:PICT? 300,300,1;" + b"PICT? 300,300,1;" * 10])
def test_other_clients_are_served_during_a_long_line(engine, line):
    """The engine yields after a number of units or bytes and waits until the present time."""
    assert engine.feed(line + b":COUN:X?\n*TST?\n", 3.0) == b""
    turns, replies = 1, b""
    while engine.waits_until is not None:
        assert engine.waits_until == 3.0
        replies += engine.feed(b"", 3.0)
        turns += 1
    assert turns >= 4
    assert replies.endswith(b"0.00\n0\n")


def test_replies_beyond_the_limit_of_a_line_are_not_computed(engine):
    """Thirty pictures in a line cost no more than the four that are begun; every one left out is an error."""
    client = EngineClient(engine.instrument)
    picture = engine.instrument.autograph.picture
    asked = []
    engine.instrument.autograph.picture = lambda *what: asked.append(what) or picture(*what)
    reply = client.feed(b"EYEP:PICT? 1024,1024,1;" + b"PICT? 1024,1024,1;" * 29 + b"*ESR?\n")
    assert len(reply) == 3 * (9 + 1024 * 1024) + 3
    assert len(asked) == 4
    assert client.query("SYST:ERR:COUN?;*ESR?") == "28;132"


@given(
    parts=st.lists(
        st.sampled_from([b"DRIV:X 50", b"DRIV:X 0", b"*WAI", b"*OPC?", b"COUN:X?", b"FOO", b"\n"]), max_size=20
    ),
    size=st.integers(1, 9),
)
def test_waiting_changes_no_reply_and_loses_none(parts, size):
    flood = b";".join(parts) + b"\n"
    patient, hasty = EngineClient(), SharedInstrument(Autograph(VARIANTS["A7"])).open()
    time = 0.0
    replies = b""
    for start in range(0, len(flood), size):
        replies += hasty.feed(flood[start : start + size], time)
    while hasty.waits_until is not None:
        time = hasty.waits_until
        replies += hasty.feed(b"", time)
    assert replies == patient.feed(flood)
