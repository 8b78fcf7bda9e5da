"""A server that looks again before it sleeps gives way to its client, and to nobody else for long."""

import pytest

from a7sim.link.server import cpu_yield


class Machine:
    """A processor that is given back after `away` seconds."""

    def __init__(self) -> None:
        self.now = 100.0
        self.away = 1e-5
        self.given_up = 0

    def give_up(self) -> None:
        self.given_up += 1
        self.now += self.away


@pytest.fixture
def machine(monkeypatch):
    machine = Machine()
    monkeypatch.setattr(cpu_yield, "monotonic", lambda: machine.now)
    monkeypatch.setattr(cpu_yield.os, "sched_yield", machine.give_up)
    return machine


def test_the_processor_is_given_up_as_long_as_it_comes_back_soon(machine):
    server = cpu_yield.YieldPolicy()
    assert all(server.yield_cpu() for _ in range(100))
    assert machine.given_up == 100


def test_where_others_want_it_it_is_kept_for_a_second(machine):
    server = cpu_yield.YieldPolicy()
    machine.away = 3e-3
    assert [server.yield_cpu() for _ in range(100)] == [True] * 2 + [False] * 98
    machine.now += cpu_yield.UNTIL_ALONE
    assert server.yield_cpu()


def test_being_away_once_says_nothing(machine):
    """A server that was stopped, or had to wait for a page, is not in company."""
    server = cpu_yield.YieldPolicy()
    for away in [3e-3, 1e-5] * 50:
        machine.away = away
        assert server.yield_cpu()
