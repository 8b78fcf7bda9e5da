"""Telnet and RFC 2217 without a wire: RFC 854 (commands), 855 (options), 856 (binary), 2217 (com port options)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim.link.server.telnet import MAX_SUBNEGOTIATION_LENGTH, Telnet

WILL_BINARY, WONT_BINARY = b"\xff\xfb\x00", b"\xff\xfc\x00"


def com_port(option, value=b""):
    return b"\xff\xfa\x2c" + bytes([option]) + value.replace(b"\xff", b"\xff\xff") + b"\xff\xf0"


@given(st.binary(max_size=200), st.integers(1, 7))
def test_binary_data_survives_escaping_in_any_pieces(data, size):
    line = WILL_BINARY + Telnet.escape(data)
    telnet = Telnet()
    assert b"".join(telnet.received(line[i : i + size])[0] for i in range(0, len(line), size)) == data


@given(st.binary(max_size=300))
def test_any_bytes_are_accepted_and_answers_stay_short(noise):
    telnet = Telnet()
    _, answer = telnet.received(noise)
    assert len(answer) <= 12 * len(noise)
    telnet.received(b"\xff\xf0" + WILL_BINARY)
    assert telnet.received(b"\x41*TST?\n")[0].endswith(b"*TST?\n")


def test_without_binary_a_nul_after_a_cr_is_padding():
    telnet = Telnet()
    assert telnet.received(b"A\r\0B\0\r")[0] == b"A\rB\0\r"
    assert telnet.received(b"\0C")[0] == b"C"
    telnet.received(WILL_BINARY)
    assert telnet.received(b"A\r\0B")[0] == b"A\r\0B"


@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        (b"\xff\xfd\x00", b""),
        (b"\xff\xfb\x03", b""),
        (b"\xff\xfd\x01", b"\xff\xfc\x01"),
        (b"\xff\xfb\x18", b"\xff\xfe\x18"),
        (b"\xff\xfe\x00", b"\xff\xfc\x00"),
        (b"\xff\xfe\x01", b""),
        (b"\xff\xfb\x2c", b"\xff\xfd\x2c" + com_port(107, b"\xb0")),
    ],
)
def test_an_option_is_answered_if_it_changes_a_state(asked, answer):
    assert Telnet().received(asked) == (b"", answer)


def test_an_option_requested_twice_is_answered_once():
    telnet = Telnet()
    first = telnet.received(b"\xff\xfe\x00\xff\xfd\x00")[1]
    assert first == b"\xff\xfc\x00\xff\xfb\x00"
    assert telnet.received(b"\xff\xfd\x00")[1] == b""


@pytest.mark.parametrize(
    ("option", "value", "answer"),
    [
        (1, bytes(4), (9600).to_bytes(4, "big")),
        (1, (115200).to_bytes(4, "big"), (115200).to_bytes(4, "big")),
        (1, b"\xff\xff\xff\xff", b"\xff\xff\xff\xff"),
        (1, b"\x01", (9600).to_bytes(4, "big")),
        (2, b"\x07", b"\x07"),
        (2, b"\x00", b"\x08"),
        (3, b"\x03", b"\x03"),
        (4, b"\x02", b"\x02"),
        (5, b"\x00", b"\x01"),
        (5, b"\x08", b"\x08"),
        (5, b"\x0a", b"\x0b"),
        (7, b"", b"\xb0"),
        (11, b"\xff", b"\xff"),
        (12, b"\x03", b"\x03"),
        (0, b"", b"a7sim"),
        (6, b"", b"\x00"),
    ],
)
def test_com_port_settings_are_accepted_and_confirmed(option, value, answer):
    telnet = Telnet()
    assert telnet.received(com_port(option, value)) == (b"", com_port(option + 100, answer))


def test_a_control_that_was_set_is_returned_on_request():
    telnet = Telnet()
    telnet.received(com_port(5, b"\x09"))
    assert telnet.received(com_port(5, b"\x07"))[1] == com_port(105, b"\x09")


def test_the_buffer_of_an_endless_subnegotiation_is_bounded_until_its_end():
    telnet = Telnet()
    assert telnet.received(b"\xff\xfa\x2c\x01" + b"x" * 1_000_000) == (b"", b"")
    assert len(telnet._sub) == MAX_SUBNEGOTIATION_LENGTH
    assert telnet.received(b"\xff\xf0*TST?\n")[0] == b"*TST?\n"


@pytest.mark.parametrize(
    "sent",
    [com_port(8, b""), com_port(99, b"\x01"), com_port(5, b""), b"\xff\xfa\x2c\xff\xf0", b"\xff\xfa\x18\x01\xff\xf0"],
    ids=["flow control is suspended", "an unknown option", "a control of nothing", "no option", "another negotiation"],
)
def test_an_unknown_request_gets_no_answer_and_the_data_after_it_are_read(sent):
    assert Telnet().received(sent + b"*TST?\n") == (b"*TST?\n", b"")


def test_a_command_within_a_subnegotiation_is_ignored():
    within = com_port(1, (115200).to_bytes(4, "big"))
    with_nop = within[:6] + b"\xff\xf1" + within[6:]
    assert Telnet().received(with_nop) == Telnet().received(within)
