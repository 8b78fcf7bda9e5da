"""Records of a session's results; `results` makes the document from them."""

from collections.abc import Mapping
from typing import Literal

import msgspec
import numpy as np

from a7sim.operator import ModelRecord
from a7sim.reduction import Model
from a7sim.reduction.strips import CENTRE
from a7sim.result_documents import Document
from a7sim.scenario import Scenario
from a7sim.scenario.schema import Published
from a7sim.session.truth import TruthComparison
from a7sim.strip_methods.strip import StripResult

CENTRE_DECIMALS = 5
"""Decimals of a perspective centre in counter units."""

POINT_DECIMALS = 3
"""Decimals of a point in counter units in the document."""

Status = Literal["complete", "does not fit", "interrupted", "failed"]
"""End of a session; 'does not fit' if the operator gave up."""


class ModelResult(msgspec.Struct, frozen=True, eq=False):
    """Record of a model measured at the plotter, and its comparison with the truth."""

    record: ModelRecord
    comparison: TruthComparison
    """Of one session, or of a batch."""
    member: int = 0
    """Index of the session in the batch axis of the comparison."""
    published: Published | None = None

    @property
    def model(self) -> Model:
        """The model in mm, Z upward, with its perspective centres ``<photo>:centre``.

        Points are unrounded. Centres have `CENTRE_DECIMALS`, because the last bits of their least squares depend on the
        size of the batch, and the strip must not.
        """
        return self._model(self.record.points)

    @property
    def rounded_model(self) -> Model:
        """The model with the digits of the document, for the files of models and cards."""
        rounded = {
            name: (round(x, POINT_DECIMALS), round(y, POINT_DECIMALS), round(z, POINT_DECIMALS))
            for name, (x, y, z) in self.record.points.items()
        }
        return self._model(rounded)

    def _model(self, points: Mapping[str, tuple[float, float, float]]) -> Model:
        record = self.record
        coordinates = dict(points)
        for side, centre in record.centres.items():
            photograph = record.model.left if side == 1 else record.model.right
            x, y, z = (round(float(each), CENTRE_DECIMALS) for each in (centre.X0, centre.Y0, centre.Z0))
            coordinates[photograph + CENTRE] = (x, y, z)
        units_per_mm = [[record.xy_units_per_mm], [record.xy_units_per_mm], [record.z_units_per_mm]]
        return Model(record.model.name, tuple(coordinates), np.array(list(coordinates.values())).T / units_per_mm)


class SessionEnd(msgspec.Struct, frozen=True, eq=False):
    """End of a session over the link: its status, and the acts of the operator."""

    status: Status = "failed"
    message: str = ""
    operator: Document = {}
    """Hours by activity, and counts of lines and book entries."""
    slips: list[Document] = []
    """The operator's unnoticed errors with the right values."""


class BridgeResult(msgspec.Struct, frozen=True, eq=False):
    """Result of bridging: the strip, or the reason why there is none, and the hours."""

    result: StripResult | None
    message: str
    operator: Document


class SessionResult(msgspec.Struct, frozen=True, eq=False):
    """Result of a session: the models measured at the plotter, their strip, and the strips of the other methods."""

    scenario: Scenario
    seed: int
    status: Status = "complete"
    message: str = ""
    models: tuple[ModelResult, ...] | None = None
    """None if the scenario has no work at the plotter."""
    operator: Document | None = None
    slips: list[Document] | None = None
    """None in a batch, which has no observation book."""
    strip: StripResult | None = None
    """None if the models form no strip; then `strip_message` is the reason, or "" if no strip was computed."""
    strip_message: str = ""
    methods: Mapping[str, StripResult] = {}
    """Strips of comparator, A8 and bridge, by name."""
    bridging: BridgeResult | None = None

    @property
    def strip_models(self) -> list[Model]:
        """Models measured at the plotter in mm, Z upward, with their perspective centres."""
        return [each.model for each in self.models or ()]
