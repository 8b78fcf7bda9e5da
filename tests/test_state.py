"""The state of an instrument is complete (issue 6): the restored instrument continues as the original."""

import json
import random

import pytest

from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.journal.checkpoints import Checkpoint, differences, read_checkpoints, state_hash, to_lines
from a7sim.link.clock import Clock
from a7sim.link.simulated_wait import feed_until_idle
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene

LINES = {
    "akwanga": [
        "PROJ{n}:KAPP {a:.2f};PHI {b:.2f};:SYST:ERR?",
        "PROJ{n}:BY {c:.2f};BY:TURN {d:.4f}",
        "PROJ{n}:PDIS 15{m}.5",
        "FITT:DOVE IN;XCOL OUT",
        "BASE:BX {x:.2f};MODE OUT;*OPC",
        "GEAR:HEIG 'Dc';PLAN '2-1-1'",
        "COUN:Y:PRES {x:.2f}",
    ],
    "akwanga-a8": ["COMM:PHI {b:.2f}", "PROJ{n}:OMEG {b:.2f}", "BASE:BX {x:.2f}"],
}
OF_ALL = [
    "DRIV:X {x:.2f};:WHE:Y {c:.3f};:DRIV:Z MAX",
    'PHOT{n}:LOAD "10{m}";CENT {d:.3f},{d:.3f},{d:.3f};CENT?;FID?',
    'REC "P{m}",KAPP1,BX;:REC:LAST?;COUN?;STR {m},"misread"',
    "*ESE 255;*SRE 48;:STAT:OPER:ENAB 2;:*STB?;*ESR?;:SYST:ERR:COUN?",
    'EYEP1? "1011";:EYEP2? "1021";:COUN?;*OPC?',
    "SYST:LOCK:REQ?;:FOO",
    "SYST:LOCK:REL;:STAT:OPER?",
    "*CLS;:SYST:ERR?;:PHOT1?;:PROJ1:PHI?;:PROJ2:OMEG?;:BASE:BX?",
]


def line(dice, name):
    a, b, c = dice.uniform(-5, 5), dice.uniform(98, 102), dice.uniform(-4, 4)
    given = {"n": dice.choice((1, 2)), "m": dice.choice((1, 2, 3)), "a": a, "b": b, "c": c, "d": c / 20}
    return dice.choice(LINES[name] + OF_ALL).format(**given, x=dice.uniform(90, 200)).encode() + b"\n"


def worn(name, token=None):
    scenario = load_scenario(name, {"instrument.condition": '"worn"', "instrument.laying_sigma_mm": "0.3"})
    return SharedInstrument(build_autograph(scenario.instrument, build_scene(scenario, 3).mountable, 3), token=token)


@pytest.mark.parametrize("name", list(LINES))
@pytest.mark.parametrize("seed", range(4))
def test_a_restored_instrument_continues_as_the_original(name, seed):
    """The instrument is worn, draws random numbers at every setting and has two busy clients."""
    dice = random.Random(seed)
    instrument, clock = worn(name, "sesame"), Clock()
    engines = [instrument.open(), instrument.open()]
    engines[0].feed(b'SYST:LOG "sesame";:REC "P0"\n', 0.0)
    engines[1].feed(b'SYST:LOG "sesame"\n' if seed % 2 else b"COUN?\n", 0.0)
    for _ in range(60):
        feed_until_idle(dice.choice(engines), line(dice, name), clock)
    changes = len(instrument.autograph.recorder.changes)
    state = json.loads(json.dumps(instrument.state()))
    again = worn(name, "sesame")
    again.restore(state)
    assert json.loads(json.dumps(again.state())) == state
    later = Clock(clock.now)
    for _ in range(60):
        client, sent = dice.choice(engines).client, line(dice, name)
        expected = feed_until_idle(instrument.clients[client], sent, clock)
        assert feed_until_idle(again.clients[client], sent, later) == expected
    assert clock.now == later.now
    assert instrument.state(changes) == again.state(changes)
    assert len(instrument.state(changes)["autograph"]["registered"]) < len(instrument.autograph.recorder.changes)
    assert again.open().client == "client3"


def test_states_that_do_not_match_their_hash_are_ignored(tmp_path):
    states = [{"a": 1, "b": [1.5]}, {"a": 2, "b": [1.5]}]
    kept = [Checkpoint(n, 1.0, state_hash(state), state) for n, state in enumerate(states)]
    (tmp_path / "states").write_bytes(to_lines(kept))
    assert list(read_checkpoints(tmp_path / "states")) == kept
    (tmp_path / "states").write_bytes(to_lines(kept).replace(b'"a":2', b'"a":3'))
    assert list(read_checkpoints(tmp_path / "states")) == kept[:1]
    for damaged in (to_lines(kept)[:-9], to_lines(kept).replace(b'"b"', b'"\xff"')):
        (tmp_path / "states").write_bytes(damaged)
        assert list(read_checkpoints(tmp_path / "states")) in (kept[:1], [])
    assert list(read_checkpoints(tmp_path / "nowhere")) == []


def test_differences_are_reported_with_their_part():
    was, is_now = {"x": {"at": 1.0, "of": [1]}, "y": 2}, {"x": {"at": 1.5, "of": [1]}, "z": 3}
    assert [(each.part, each.before, each.after) for each in differences(was, is_now)] == [
        ("x.at", 1.0, 1.5),
        ("y", 2, None),
        ("z", None, 3),
    ]
