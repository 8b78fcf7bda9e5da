"""Responses of a study: one number each, read from the results of every replicate."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from types import MappingProxyType
from typing import Any

from a7sim.errors import A7SimError
from a7sim.result_documents import Document

Reader = Callable[[Document], float]

SIGNIFICANT = 10
"""Significant digits of a response; the last bits of a sum depend on the batch of a session."""

OF_MODEL = "@"
"""Prefix of the number of a model, if a response is read from one model."""
OF_ALL = (", rms of the models", " of the models", ", rms of all")
"""Endings of the meaning of a response over all models."""

BRANCHES = ("models", "strip", "ways", "operator", "a8_minus_comparator_m")
"""Keys at which the paths of responses start."""


@dataclass(frozen=True)
class Response:
    """Number of a session: name, unit, meaning, and how it is read from the results."""

    name: str
    unit: str
    meaning: str
    read: Reader
    model: int | None = None
    """Number of its model, counted from 1; None if it may be read anywhere in the results."""

    def of_all(self, documents: Sequence[Document]) -> list[float]:
        """Return the responses of sessions; sessions that share the model of a response are read once."""
        if self.model is None:
            return [self.of(each) for each in documents]
        found: dict[object, float] = {}
        for each in documents:
            key = self._source(each)
            if key not in found:
                found[key] = self.of(each)
        return [found[self._source(each)] for each in documents]

    def _source(self, document: Document) -> tuple[str, int]:
        """Return the key that identifies the model of a stored document."""
        models = document.get("models", ())
        shared = models[self.model - 1] if self.model is not None and len(models) >= self.model else document
        return document["status"], id(shared)

    def of(self, document: Document) -> float:
        """Return the response of a session to ten digits; nan if the operator gave up.

        Raises A7SimError if a complete session has no such response.
        """
        if document["status"] != "complete":
            return math.nan
        try:
            return float(f"{self.read(document):.{SIGNIFICANT}g}")
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise A7SimError(
                f"response {self.name!r}: expected a number in the results, found none ({error})"
            ) from error


def find_response(name: str) -> Response:
    """Return a response by its name, its name in one model such as `base_error_gon@2`, or its path.

    Raises A7SimError for anything else.
    """
    if name in RESPONSES:
        return RESPONSES[name]
    whole, at, model = name.partition(OF_MODEL)
    if at and whole in RESPONSES and model.isdecimal() and int(model) > 0:
        return _in_one_model(RESPONSES[whole], int(model))
    parts = name.split(".")
    if len(parts) > 1 and parts[0] in BRANCHES:
        return Response(name, "", f"{name} in results.json", lambda document: _at(document, parts))
    near = get_close_matches(name, RESPONSES, n=1)
    hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(RESPONSES)}"
    raise A7SimError(f"responses: expected a response or a path that begins with models., got {name!r}; {hint}")


def needs_strip(name: str) -> bool:
    """Return whether a response is read from the strip on the ground of a session at the plotter."""
    return "_at_" in name or name.startswith("strip.")


def is_path(name: str) -> bool:
    """Return whether a response is read by its path, wherever in the results it leads."""
    return "." in name


def _in_one_model(response: Response, model: int) -> Response:
    """Return a response of all models read in one model, counted from 1.

    Raises A7SimError for a response of the strip.
    """
    of_all = next((each for each in OF_ALL if response.meaning.endswith(each)), None)
    if of_all is None:
        raise A7SimError(f"responses: expected a response of models before {OF_MODEL}, got {response.name!r}")

    def read(document: Document) -> float:
        models = document["models"][model - 1 : model]
        if not models:
            raise IndexError(f"there are {len(document['models'])} models")
        return response.read({**document, "models": models})

    meaning = f"{response.meaning.removesuffix(of_all)} of model {model}"
    return Response(f"{response.name}{OF_MODEL}{model}", response.unit, meaning, read, model)


def _at(document: Document, parts: list[str]) -> float:
    value: Any = document
    for depth, part in enumerate(parts):
        try:
            value = value[int(part)] if isinstance(value, list) else value[part]
        except (KeyError, IndexError, ValueError):
            known = list(value) if isinstance(value, Mapping) else range(len(value))
            where = ".".join(parts[:depth])
            raise KeyError(f"at {where} there are {', '.join(map(str, known))}, not {part!r}") from None
    if not isinstance(value, int | float):
        raise TypeError(f"{'.'.join(parts)} is no number")
    return value


def _rms(values: Iterator[float]) -> float:
    squares = [value * value for value in values]
    if not squares:
        raise ValueError("no model has one")
    return math.sqrt(math.fsum(squares) / len(squares))


def _of_models(read: Reader) -> Reader:
    return lambda document: _rms(read(model) for model in document["models"])


def _centre_difference(axis: str) -> Reader:
    return lambda document: _rms(
        side[f"{axis}0"] for model in document["models"] for side in model["truth"]["centre_differences"].values()
    )


def _accuracy(on: str, what: str) -> Reader:
    def read(document: Document) -> float:
        return float(_only_strip(document)["accuracy_m"][on][what])

    return read


def _only_strip(document: Document) -> Document:
    """Return the strip of a session, or of the first of its methods."""
    strip: Document = document["strip"] if "strip" in document else next(iter(document["ways"].values()))
    if "message" in strip:
        raise ValueError(strip["message"])
    return strip


def _at_checks(what: str, axis: str) -> Reader:
    def read(document: Document) -> float:
        strip = _only_strip(document)
        return float(strip.get("polynomial", strip)["accuracy_m"]["checks"][what][axis])

    return read


_COUNTER = "counter units"
_LISTED = (
    Response(
        "residual_parallax_mm",
        "mm",
        "rms residual y-parallax at model scale, rms of the models",
        _of_models(lambda model: float(model["relative_orientation"]["rms_parallax_mm"])),
    ),
    Response(
        "iterations",
        "",
        "rounds of relative orientation, rms of the models",
        _of_models(lambda model: float(model["relative_orientation"]["iterations"])),
    ),
    Response(
        "rotation_error_gon",
        "gon",
        "angle between found and true relative rotation, rms of the models",
        _of_models(lambda model: float(model["truth"]["rotation_difference_gon"])),
    ),
    Response(
        "base_error_gon",
        "gon",
        "angle between found and true base, rms of the models",
        _of_models(lambda model: float(model["truth"]["base_difference_gon"])),
    ),
    *(
        Response(
            f"centre_{axis}_error",
            _COUNTER,
            f"{axis} of the perspective centres, found minus true, rms of all",
            _centre_difference(axis),
        )
        for axis in "XYZ"
    ),
    *(
        Response(f"strip_{what}_at_{on}_m", "m", f"rms residual of the strip in {what} at {on}", _accuracy(on, what))
        for on in ("control", "checks")
        for what in ("plan", "height")
    ),
    *(
        Response(f"{name}_{axis}_at_checks_m", "m", f"{words} residual in {axis} at checks, as adjusted", read)
        for name, what, words in (("adjusted", "rms", "rms"), ("largest", "largest", "largest"))
        for axis in "XYZ"
        for read in [_at_checks(what, axis)]
    ),
    Response("hours", "h", "hours at the instrument", lambda document: float(document["operator"]["hours"])),
)

RESPONSES: Mapping[str, Response] = MappingProxyType({each.name: each for each in _LISTED})
"""Responses by short name."""
