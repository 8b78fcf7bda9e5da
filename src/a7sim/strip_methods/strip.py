"""Strip of a session's models on the ground (thesis 4.3): one, or all combinations of cases."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from a7sim.errors import A7SimError
from a7sim.reduction import (
    AbsoluteOrientation,
    Ground,
    Model,
    Strip,
    StripAdjustment,
    absolute_orientation,
    deck_lines,
    formed_strip,
    output_lines,
    strip_adjustment,
)
from a7sim.reduction.polynomials import Degree
from a7sim.reduction.strips import CENTRE, JoinMethod, is_centre
from a7sim.result_documents import Document, absolute_document, adjustment_document, joins_document
from a7sim.scenario import Scenario
from a7sim.scene import Scene

FIRST_FREE_NUMBER = 9001
MAX_CARD_NUMBER_LENGTH = 5


@dataclass(frozen=True)
class StripCards:
    """Strip on cards: the deck, the output, and the number of each point."""

    deck: list[str]
    output: list[str]
    key: Mapping[str, str]


@dataclass(frozen=True)
class OrientedStrip:
    """Strip, its absolute orientation and, if requested, its adjustment by polynomials."""

    formed: Strip
    oriented: AbsoluteOrientation
    adjusted: StripAdjustment | None = None

    @property
    def points(self) -> Model:
        """All points on the ground, after the last adjustment."""
        return (self.adjusted or self.oriented).model

    @property
    def on_ground(self) -> Strip:
        """Strip in the system of the ground, each model with its own coordinates."""
        return self.formed.transformed(self.oriented.similarity)


class StripResult(msgspec.Struct, frozen=True, eq=False):
    """A measured strip: its independent models, and the strip on the ground."""

    models: tuple[Model, ...]
    strip: OrientedStrip


def ground_control(scenario: Scenario, scene: Scene) -> Ground:
    """Return the list of ground control and checks for the computation."""
    names = tuple(point.point for point in scenario.ground)
    coordinates = np.array([scene.ground_points[name] for name in names]).reshape(-1, 3).T
    return Ground(names, coordinates, tuple(point.role for point in scenario.ground))


def given_control(scenario: Scenario, scene: Scene) -> Ground:
    """Return the ground control for the operator: no checks, and nan for coordinates that a point's role leaves out."""
    ground = ground_control(scenario, scene)
    known = np.where(ground.used > 0.0, ground.coordinates, np.nan)
    given = np.flatnonzero(ground.used.any(axis=0))
    return Ground(tuple(ground.points[i] for i in given), known[:, given], tuple(ground.roles[i] for i in given))


def orient_strip(
    models: Sequence[Model], ground: Ground, method: JoinMethod = "points", degree: Degree | None = None
) -> OrientedStrip:
    """Return the strip of models on its control.

    Raises Undetermined or A7SimError for too few models or control points.
    """
    formed = formed_strip(models, method)
    oriented = absolute_orientation(formed, ground)
    return OrientedStrip(formed, oriented, strip_adjustment(oriented.model, ground, degree) if degree else None)


def oriented_strip_document(strip: OrientedStrip) -> Document:
    """Return a strip on the ground as a document."""
    document: Document = {"joins": joins_document(strip.formed)} | absolute_document(strip.oriented)
    return document | ({"polynomial": adjustment_document(strip.adjusted)} if strip.adjusted else {})


def models_from_documents(documents: Sequence[Document]) -> list[Model]:
    """Return the models of a document of results in mm, Z upward, with their centres."""
    return [_model(each) for each in documents]


def _model(document: Document) -> Model:
    xy_units, height = document["xy_units_per_mm"], document["z_units_per_mm"]
    places = {point: (each["X"], each["Y"], each["Z"]) for point, each in document["points"].items()}
    for side, centre in document["perspective_centres"].items():
        places[f"{document[side]}:centre"] = (centre["X0"], centre["Y0"], centre["Z0"])
    coordinates = np.array(list(places.values())).T / [[xy_units], [xy_units], [height]]
    return Model(document["model"], tuple(places), coordinates)


def strip_cards(strip: OrientedStrip, models: Sequence[Model], ground: Ground) -> StripCards:
    """Return the N.R.C. cards of a strip: the input deck, and the output with residuals and deviations.

    Names that are not numbers of up to five digits get one. Raises A7SimError for coordinates that do not fit nine
    columns.
    """
    key = card_numbers([*ground.points, *(name for model in models for name in model.points)])
    numbered_ground = Ground(tuple(key[name] for name in ground.points), ground.coordinates, ground.roles)
    on_ground = strip.on_ground
    numbered_strip = Strip(tuple(_numbered(model, key) for model in on_ground.models), on_ground.joins)
    deck = _fit_to_columns(
        lambda decimals: deck_lines(numbered_ground, [_numbered(model, key) for model in models], decimals)
    )
    return StripCards(
        deck, _fit_to_columns(lambda decimals: output_lines(numbered_ground, numbered_strip, decimals)), key
    )


def card_numbers(names: Iterable[str]) -> dict[str, str]:
    """Return the names of points for cards; `<photo>:centre` keeps its photograph."""
    unique = dict.fromkeys(names)
    used = {name.removesuffix(CENTRE) for name in unique}
    free = (str(number) for number in range(FIRST_FREE_NUMBER, 100_000) if str(number) not in used)
    return {name: name if _is_card_number(name) else next(free) + CENTRE * is_centre(name) for name in unique}


def _is_card_number(name: str) -> bool:
    name = name.removesuffix(CENTRE)
    return name.isascii() and name.isdigit() and len(name) <= MAX_CARD_NUMBER_LENGTH and int(name) > 0


def _numbered(model: Model, key: Mapping[str, str]) -> Model:
    return Model(model.name, tuple(key[name] for name in model.points), model.coordinates)


def _fit_to_columns(lines_of: Callable[[int], list[str]]) -> list[str]:
    """Return cards with as many decimals as nine columns allow, three at most."""
    for decimals in (3, 2):
        try:
            return lines_of(decimals)
        except A7SimError:
            continue
    return lines_of(1)
