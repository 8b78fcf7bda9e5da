"""Positions of factor levels on an axis, if they are numbers or stand for numbers."""

from typing import Any

from a7sim.result_documents import Document
from a7sim.standard_points import CASES
from a7sim.study.cells import factor_levels
from a7sim.study.loading import LoadedStudy
from a7sim.study.schema import Factor


def axis_positions(loaded: LoadedStudy) -> dict[str, Document]:
    """Return for each factor the axis label and the position of each level; a factor without an axis is left out."""
    own = {factor.name: factor for factor in loaded.study.factor}
    found = {}
    for name, levels in loaded.factors.items():
        axis = _of_factor(own[name]) if name in own else _of_cases(name, levels)
        if axis and len(set(axis["at"].values())) > 1:
            found[name] = axis
    return found


def _of_cases(name: str, cases: list[str]) -> Document:
    return {"counts": f"points of orientation, {name}", "at": {case: len(CASES[case]) for case in cases}}


def _of_factor(factor: Factor) -> Document:
    labels = [level.label for level in factor_levels(factor)] if factor.levels else []
    if factor.path == "plan.case":
        return _of_cases(factor.name, labels)
    if factor.levels and all(_is_number(each) for each in factor.levels):
        return {"counts": factor.name, "at": dict(zip(labels, factor.levels, strict=True))}
    if factor.levels and all(isinstance(each, list) and _numbers(each) for each in factor.levels):
        apart = [float(max(each) - min(each)) for each in factor.levels]
        return {"counts": f"separation of {factor.name}", "at": dict(zip(labels, apart, strict=True))}
    return {}


def _numbers(values: list[Any]) -> bool:
    return len(values) > 1 and all(_is_number(each) for each in values)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
