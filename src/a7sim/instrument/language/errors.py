"""Error numbers of SCPI-1999 used by the language."""

from enum import IntEnum

MAX_DETAIL_LENGTH = 180


class ErrorNumber(IntEnum):
    """Error number with its message."""

    message: str

    def __new__(cls, number: int, message: str) -> "ErrorNumber":
        """Return the member with its message."""
        member = int.__new__(cls, number)
        member._value_ = number
        member.message = message
        return member

    NO_ERROR = 0, "No error"
    INVALID_CHARACTER = -101, "Invalid character"
    SYNTAX_ERROR = -102, "Syntax error"
    DATA_TYPE_ERROR = -104, "Data type error"
    PARAMETER_NOT_ALLOWED = -108, "Parameter not allowed"
    MISSING_PARAMETER = -109, "Missing parameter"
    UNDEFINED_HEADER = -113, "Undefined header"
    HEADER_SUFFIX_OUT_OF_RANGE = -114, "Header suffix out of range"
    INVALID_SUFFIX = -131, "Invalid suffix"
    SUFFIX_NOT_ALLOWED = -138, "Suffix not allowed"
    EXECUTION_ERROR = -200, "Execution error"
    COMMAND_PROTECTED = -203, "Command protected"
    SETTINGS_CONFLICT = -221, "Settings conflict"
    DATA_OUT_OF_RANGE = -222, "Data out of range"
    ILLEGAL_PARAMETER_VALUE = -224, "Illegal parameter value"
    QUEUE_OVERFLOW = -350, "Queue overflow"
    INPUT_BUFFER_OVERRUN = -363, "Input buffer overrun"
    TIME_OUT_ERROR = -365, "Time out error"
    QUERY_DEADLOCKED = -430, "Query DEADLOCKED"


class CommandError(Exception):
    """Unit that cannot be executed: an entry for the error queue."""

    def __init__(self, number: ErrorNumber, detail: str = "") -> None:
        super().__init__(number, detail)
        self.number = number
        self.detail = detail


def format_entry(number: ErrorNumber, detail: str = "") -> str:
    """Return an error in the form of `SYSTem:ERRor?`: number, then message and detail in quotes."""
    printable = "".join(c if " " <= c <= "~" else "?" for c in detail).replace('"', "'")
    text = f"{number.message};{printable[:MAX_DETAIL_LENGTH]}" if printable else number.message
    return f'{int(number)},"{text}"'
