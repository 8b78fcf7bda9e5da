"""Cells of a study: the combinations of factor levels of its design."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from a7sim.errors import A7SimError
from a7sim.session.combination_batch import cases_of_strips
from a7sim.standard_points import CASES
from a7sim.study.schema import MAX_CELLS, Factor, Settings, StudyDefinition


@dataclass(frozen=True)
class Level:
    """Level of a factor: its label and the settings it makes."""

    label: str
    settings: Settings


@dataclass(frozen=True)
class Cell:
    """Combination of levels, by the names of their factors."""

    number: int
    levels: Mapping[str, str]
    settings: Settings

    @property
    def label(self) -> str:
        """Levels as text."""
        return ", ".join(f"{factor} {level}" for factor, level in self.levels.items()) or "as it stands"


def make_cells(study: StudyDefinition) -> list[Cell]:
    """Return the cells of a study, numbered from 1. Raises A7SimError for factors that do not make a design."""
    for factor in study.factor:
        _see_that_it_varies(factor, study.design)
    rows = _hypercube(study) if study.design == "latin-hypercube" else _rows(study)
    if len(rows) > MAX_CELLS:
        raise A7SimError(f"factor: expected levels that make at most {MAX_CELLS} cells, got {len(rows)}")
    names = [factor.name for factor in study.factor]
    return [
        Cell(
            number,
            {name: level.label for name, level in zip(names, row, strict=True)},
            study.settings | {path: value for level in row for path, value in level.settings.items()},
        )
        for number, row in enumerate(rows, start=1)
    ]


def make_strip_cells(cells: Sequence[Cell], models: Sequence[str]) -> list[Cell]:
    """Return one cell for each strip of all combinations of cases of the models, numbered anew."""
    combinations = cases_of_strips(tuple(CASES), len(models))
    if len(cells) * len(combinations) > MAX_CELLS:
        raise A7SimError(f"strips: expected at most {MAX_CELLS} cells, got {len(cells) * len(combinations)}")
    both = enumerate(product(cells, combinations), start=1)
    return [
        Cell(
            number,
            {**cell.levels, **{f"model {name}": case for name, case in zip(models, cases, strict=True)}},
            cell.settings,
        )
        for number, (cell, cases) in both
    ]


def factor_levels(factor: Factor) -> list[Level]:
    """Return the levels of a factor as its file lists them."""
    if factor.groups:
        return [Level(name, settings) for name, settings in factor.groups.items()]
    return [Level(value_label(each), {factor.path or "": each}) for each in factor.levels]


def value_label(value: Any) -> str:
    """Return a value as a label: lists joined by dashes, numbers in their shortest form."""
    if isinstance(value, list):
        return " - ".join(value_label(each) for each in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _see_that_it_varies(factor: Factor, design: str) -> None:
    where = f"factor {factor.name!r}"
    if factor.range is not None:
        low, high = factor.range
        if design != "latin-hypercube":
            raise A7SimError(f"{where}: expected levels, got a range, which only design = 'latin-hypercube' takes")
        if factor.levels or factor.groups or factor.path is None or not low < high:
            raise A7SimError(f"{where}: expected a path and a range from low to high alone, got {low:g} to {high:g}")
        return
    if factor.groups and (factor.levels or factor.path):
        raise A7SimError(f"{where}: expected either path and levels or groups, got both")
    if factor.levels and factor.path is None:
        raise A7SimError(f"{where}: expected the path of the scenario value that its levels give, got none")
    labels = [level.label for level in factor_levels(factor)]
    if len(labels) < 2 or len(set(labels)) < len(labels):
        raise A7SimError(f"{where}: expected two different levels or more, got {', '.join(labels) or 'none'}")


def _rows(study: StudyDefinition) -> Sequence[tuple[Level, ...]]:
    choices = [factor_levels(factor) for factor in study.factor]
    if study.design == "full":
        return list(product(*choices))
    first = tuple(levels[0] for levels in choices)
    others = [
        (*first[:place], level, *first[place + 1 :]) for place, levels in enumerate(choices) for level in levels[1:]
    ]
    return [first, *others]


def _hypercube(study: StudyDefinition) -> Sequence[tuple[Level, ...]]:
    from scipy.stats import qmc  # noqa: PLC0415

    if study.samples is None or not study.factor:
        raise A7SimError("samples: expected the number of cells of the Latin hypercube and factors to vary, got none")
    places = qmc.LatinHypercube(d=len(study.factor), rng=study.seed).random(study.samples)
    return [tuple(_at(factor, at) for factor, at in zip(study.factor, row, strict=True)) for row in places.tolist()]


def _at(factor: Factor, place: float) -> Level:
    """Return the level of a factor at a position from 0 to 1."""
    if factor.range is None:
        levels = factor_levels(factor)
        return levels[int(place * len(levels))]
    low, high = factor.range
    value = float(f"{low + place * (high - low):.6g}")
    return Level(value_label(value), {factor.path or "": value})
