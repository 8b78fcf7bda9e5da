"""Measures of numbers that were answered, beside what was registered or what the maker of the papers kept back."""

import math
from collections.abc import Sequence

from a7sim.scenario import Scenario
from a7sim.training.account import Account
from a7sim.training.measures.base import HALF_A_COUNT, Found, Measure, listed, measure
from a7sim.training.witness import Reading


@measure("place-by-scales")
class PlaceByScales(Measure, frozen=True, kw_only=True):
    """How far answered coordinates of a point are from what its registered scales give (P 3.1), mm."""

    unit = "mm"
    point: str
    keys: list[str]
    """Of the answers for x and y."""

    def of(self, account: Account) -> Found:
        """Return the distance from the nearest registration of the point."""
        try:
            answered = [float(account.answers.get(key, "")) for key in self.keys]
        except ValueError:
            return Found(None, f"expected numbers for {listed(self.keys)}")
        readings = [each for each in account.readings if each.point == account.name_of(self.point)]
        if not readings:
            return Found(None, f"nothing was registered at {self.point}")
        off = {self._off(account, each, answered): each for each in readings}
        nearest = min(off)
        x, y = self._place(account, off[nearest])
        return Found(round(nearest, 4), f"answered {answered[0]:g}, {answered[1]:g}; the scales gave {x:.2f}, {y:.2f}")

    def _place(self, account: Account, reading: Reading) -> tuple[float, float]:
        variant = account.autograph.variant
        x, y = (
            (reading.shown[axis] - variant.scales[axis].at_origin) / variant.scales[axis].units_per_mm for axis in "XY"
        )
        return x - variant.centres_on_base[0] * reading.shown["bx"], y

    def _off(self, account: Account, reading: Reading, answered: Sequence[float]) -> float:
        x, y = self._place(account, reading)
        return math.hypot(answered[0] - x, answered[1] - y)

    def floor(self, scenario: Scenario) -> float:
        """Return half a count of both scales, which count in two millimetres."""
        return 2.0 * math.sqrt(2.0) * HALF_A_COUNT


@measure("answers-off")
class AnswersOff(Measure, frozen=True, kw_only=True):
    """The largest difference of several answered numbers from what the maker of the papers kept back."""

    truth = True
    keys: list[str]
    least: float = 0.0
    """What can be read of them: no tolerance is below."""

    def of(self, account: Account) -> Found:
        """Return it."""
        off: dict[str, float] = {}
        for key in self.keys:
            try:
                off[key] = abs(float(account.answers.get(key, "")) - float(account.hidden[key]))
            except (ValueError, KeyError):
                return Found(None, f"{key}: expected a number, got {account.answers.get(key, 'no answer')!r}")
        worst = max(off, key=lambda key: off[key])
        if not math.isfinite(off[worst]):
            return Found(None, f"{worst}: expected a number, got {account.answers[worst]!r}")
        return Found(round(off[worst], 4), f"{worst} was answered {account.answers[worst]}, the furthest off")

    def floor(self, scenario: Scenario) -> float:
        """Return what can be read of them."""
        return self.least
