"""Telnet with the com port options of RFC 2217, without I/O: separates data from commands, and answers these.

RFC 854 and 855 (commands, options), 856 (binary), 858 (no go-ahead), 2217 (com port control).
"""

from collections.abc import Callable

SE, SB, WILL, WONT, DO, DONT, IAC = 240, 250, 251, 252, 253, 254, 255
BINARY, NO_GO_AHEAD, COM_PORT = 0, 3, 44
WILLING = frozenset({BINARY, NO_GO_AHEAD, COM_PORT})
"""Accepted options of both sides; an instrument does not echo."""

MAX_SUBNEGOTIATION_LENGTH = 64
"""Bytes; the excess is dropped."""

TO_THE_CLIENT = 100
"""Offset of RFC 2217 from the number of a client's option to that of the answer."""

SIGNATURE, BAUD_RATE, DATA_SIZE, PARITY, STOP_SIZE, CONTROL, LINE_STATE, MODEM_STATE = range(8)
LINE_STATE_MASK, MODEM_STATE_MASK, PURGE = 10, 11, 12

_AT_FIRST = {BAUD_RATE: (9600).to_bytes(4, "big"), DATA_SIZE: b"\x08", PARITY: b"\x01", STOP_SIZE: b"\x01"}

_CONTROL_ASKED = {0: 1, 4: 6, 7: 8, 10: 11, 13: 14}
"""Control codes that query, and the first answer: no flow control, no break, DTR and RTS on, no inbound control."""

_CONTROL_GROUPS = {0: {1, 2, 3, 17, 19}, 4: {5, 6}, 7: {8, 9}, 10: {11, 12}, 13: {14, 15, 16, 18}}

READY = bytes([128 + 32 + 16])
"""Carrier detect, data set ready, clear to send."""

NAME = b"a7sim"


class Telnet:
    """One side of a telnet connection that emulates a serial port: settings are accepted without effect."""

    def __init__(self) -> None:
        self._ours = {BINARY, NO_GO_AHEAD}
        self._theirs = {BINARY, NO_GO_AHEAD}
        self._settings = dict(_AT_FIRST)
        self._control = dict(_CONTROL_ASKED)
        self._taker: Callable[[int], None] = self._take_data
        self._data = bytearray()
        self._answer = bytearray()
        self._sub = bytearray()
        self._after_cr = False
        self._in_binary = False

    @staticmethod
    def greeting() -> bytes:
        """Return the opening negotiation: eight bits and no go-ahead, both ways."""
        return bytes([IAC, WILL, BINARY, IAC, DO, BINARY, IAC, WILL, NO_GO_AHEAD, IAC, DO, NO_GO_AHEAD])

    @staticmethod
    def escape(data: bytes) -> bytes:
        """Return data escaped for the line."""
        return data.replace(b"\xff", b"\xff\xff")

    def received(self, raw: bytes) -> tuple[bytes, bytes]:
        """Process bytes from the line; return the data in them, and the answer to be sent."""
        if self._in_binary and self._taker == self._take_data and IAC not in raw:
            return raw, b""
        for byte in raw:
            self._taker(byte)
        data, answer = bytes(self._data), bytes(self._answer)
        self._data.clear()
        self._answer.clear()
        return data, answer

    def _take_data(self, byte: int) -> None:
        if byte == IAC:
            self._taker = self._take_command
            return
        padding = byte == 0 and self._after_cr and not self._in_binary
        self._after_cr = byte == 0x0D
        if not padding:
            self._data.append(byte)

    def _take_command(self, byte: int) -> None:
        self._taker = self._take_data
        if byte == IAC:
            self._data.append(IAC)
        elif byte == SB:
            self._sub.clear()
            self._taker = self._take_subnegotiation
        elif byte in (WILL, WONT, DO, DONT):
            self._taker = lambda option: self._negotiate(byte, option)

    def _negotiate(self, command: int, option: int) -> None:
        self._taker = self._take_data
        standing, yes, no = (self._theirs, DO, DONT) if command in (WILL, WONT) else (self._ours, WILL, WONT)
        if command in (WONT, DONT):
            if option in standing:
                standing.discard(option)
                self._answer += bytes([IAC, no, option])
        elif option not in WILLING:
            self._answer += bytes([IAC, no, option])
        elif option not in standing:
            standing.add(option)
            self._answer += bytes([IAC, yes, option])
        if option == BINARY and command in (WILL, WONT):
            self._in_binary = command == WILL
        if option == COM_PORT and command in (WILL, DO):
            self._tell(MODEM_STATE, READY)

    def _take_subnegotiation(self, byte: int) -> None:
        if byte == IAC:
            self._taker = self._take_command_within
        elif len(self._sub) < MAX_SUBNEGOTIATION_LENGTH:
            self._sub.append(byte)

    def _take_command_within(self, byte: int) -> None:
        self._taker = self._take_subnegotiation
        if byte == IAC:
            self._sub += bytes([IAC])[: MAX_SUBNEGOTIATION_LENGTH - len(self._sub)]
        elif byte == SE:
            self._taker = self._take_data
            if self._sub[:1] == bytes([COM_PORT]) and len(self._sub) > 1:
                self._set(self._sub[1], bytes(self._sub[2:]))

    def _set(self, option: int, value: bytes) -> None:
        if option in self._settings:
            if len(value) == len(self._settings[option]) and any(value):
                self._settings[option] = value
            self._tell(option, self._settings[option])
        elif option == CONTROL and value:
            self._tell(CONTROL, bytes([self._controlled(value[0])]))
        elif option == SIGNATURE and not value:
            self._tell(SIGNATURE, NAME)
        elif option == LINE_STATE:
            self._tell(LINE_STATE, b"\0")
        elif option == MODEM_STATE:
            self._tell(MODEM_STATE, READY)
        elif option in (LINE_STATE_MASK, MODEM_STATE_MASK, PURGE):
            self._tell(option, value)

    def _controlled(self, code: int) -> int:
        for asked, group in _CONTROL_GROUPS.items():
            if code == asked:
                return self._control[asked]
            if code in group:
                self._control[asked] = code
        return code

    def _tell(self, option: int, value: bytes) -> None:
        subnegotiation = self.escape(bytes([option + TO_THE_CLIENT]) + value)
        self._answer += bytes([IAC, SB, COM_PORT]) + subnegotiation + bytes([IAC, SE])
