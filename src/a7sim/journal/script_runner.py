"""Runner of scripts: lines are sent to a fresh instrument, and replies compared with expectations."""

from dataclasses import dataclass

from a7sim.instrument import build_autograph
from a7sim.instrument.language import Engine, Listener, SharedInstrument
from a7sim.instrument.language.engine import MAX_LINE_LENGTH
from a7sim.journal.scripts import Expect, Script, SendLine, SourceLocation, Statement, Wait
from a7sim.link.client.replies import Part, parse_reply, part_as_text
from a7sim.link.clock import Clock
from a7sim.link.simulated_wait import feed_until_idle
from a7sim.scene import build_scene


@dataclass(frozen=True)
class ExpectationFailed:
    """Failed expectation of a script: the expected and the actual reply."""

    place: SourceLocation
    expected: str
    got: str

    def __str__(self) -> str:
        return f"{self.place}: expected {self.expected}, got {self.got}"


class ScriptRunner:
    """Runner of a script, at a fresh or a given instrument."""

    def __init__(
        self,
        script: Script,
        listener: Listener | None = None,
        instrument: SharedInstrument | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._script = script
        self._clock = clock or Clock()
        self.instrument = instrument or _build_instrument(script, listener)

    def run(self, client: str | None = None) -> ExpectationFailed | None:
        """Run the statements up to the first that fails, and return that; an unexpected error is a failure."""
        engine = self.instrument.open(client, time=self._clock.now)
        for statement, next_statement in zip(
            self._script.statements, [*self._script.statements[1:], None], strict=False
        ):
            failed = self._execute(engine, statement)
            if failed is None and not _is_error_query(next_statement) and engine.errors:
                failed = ExpectationFailed(
                    statement.place, f"{_statement_line(statement)} to be obeyed", engine.errors[0]
                )
            if failed is not None:
                return failed
        self.instrument.close(engine.client, self._clock.now)
        return None

    def _execute(self, engine: Engine, statement: Statement) -> ExpectationFailed | None:
        if isinstance(statement, Wait):
            self._clock.advance(statement.seconds)
            return None
        reply = feed_until_idle(engine, _statement_line(statement).encode("latin-1", "replace") + b"\n", self._clock)
        if isinstance(statement, SendLine):
            return None
        parsed = parse_reply(reply)
        answer = () if parsed is None else tuple(field for part in parsed.parts for field in _fields(part))
        if statement.matches(answer):
            return None
        errors = f" ({engine.errors[0]})" if engine.errors else ""
        return ExpectationFailed(statement.place, str(statement), (", ".join(answer) or "no answer") + errors)


def _build_instrument(script: Script, listener: Listener | None) -> SharedInstrument:
    scene = build_scene(script.scenario, script.seed)
    return SharedInstrument(build_autograph(script.scenario.instrument, scene.mountable, script.seed), listener)


def _statement_line(statement: Statement) -> str:
    if isinstance(statement, Wait):
        return f"wait {statement.seconds:g}"
    return (statement.query if isinstance(statement, Expect) else statement.text)[: MAX_LINE_LENGTH + 1]


def _is_error_query(statement: Statement | None) -> bool:
    return isinstance(statement, Expect) and any(word in statement.query.upper() for word in ("ERR", "*ESR", "*STB"))


def _fields(part: Part) -> list[str]:
    """Return the values of a reply, texts with their quotes."""
    text, fields, in_quotes = part_as_text(part), [""], False
    for character in text:
        in_quotes ^= character == '"'
        if character == "," and not in_quotes:
            fields.append("")
        else:
            fields[-1] += character
    return fields
