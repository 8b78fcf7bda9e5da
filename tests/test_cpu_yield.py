"""A server that polls before it sleeps yields the processor to its client, but not long to other programs."""

import pytest

from a7sim.link.server import cpu_yield


class Machine:
    """A processor that returns to the server after `away` seconds."""

    def __init__(self) -> None:
        self.now = 100.0
        self.away = 1e-5
        self.yields = 0

    def sched_yield(self) -> None:
        self.yields += 1
        self.now += self.away


@pytest.fixture
def machine(monkeypatch):
    machine = Machine()
    monkeypatch.setattr(cpu_yield, "monotonic", lambda: machine.now)
    monkeypatch.setattr(cpu_yield.os, "sched_yield", machine.sched_yield)
    return machine


def test_a_server_yields_while_the_processor_returns_soon(machine):
    server = cpu_yield.YieldPolicy()
    assert all(server.yield_cpu() for _ in range(100))
    assert machine.yields == 100


def test_on_a_busy_machine_a_server_stops_yielding_for_a_second(machine):
    server = cpu_yield.YieldPolicy()
    machine.away = 3e-3
    assert [server.yield_cpu() for _ in range(100)] == [True] * 2 + [False] * 98
    machine.now += cpu_yield.UNTIL_ALONE
    assert server.yield_cpu()


def test_a_single_long_absence_does_not_stop_yielding(machine):
    """A server that was stopped, or that waited for a page, is not on a busy machine."""
    server = cpu_yield.YieldPolicy()
    for away in [3e-3, 1e-5] * 50:
        machine.away = away
        assert server.yield_cpu()
