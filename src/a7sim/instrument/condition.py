"""Condition of an instrument, drawn by a seed for a class of maintenance (docs/decisions/0006-condition.md)."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import msgspec
import numpy as np

from a7sim.geometry import Array
from a7sim.instrument.local_errors import smooth_local_errors
from a7sim.scenario.schema import Condition, Instrument, MaintenanceClass, ProjectorCondition

INSTRUMENT_STREAM = 3
"""Spawn key of the instrument's random numbers, between those of the scene and the operator."""

_FAULTS = 0
"""Spawn key, below it, of the faults of the instrument."""

_PATTERNS = 2**31


@dataclass(frozen=True)
class FaultSigmas:
    """Sizes of the faults of a class of maintenance: standard deviations, unless stated as a size."""

    local_um: tuple[float, float]
    """Range of the standard error of a projector's local errors."""
    principal_distance_mm: float
    principal_point_um: float
    tilt_zero_gon: float
    base_zero_mm: float
    axes_um: float
    rod_um: float
    carriage_scale_ppm: float
    carriage_skew_ppm: float
    carriage_periodic_um: float
    """Size of the amplitudes."""
    setting_mm: float
    setting_gon: float
    backlash_mm: float
    """Size, as the next two."""
    backlash_gon: float
    carriage_backlash_mm: float
    counter_slip_share: float


FAULT_SIGMAS: Mapping[MaintenanceClass, FaultSigmas] = MappingProxyType(
    {
        "new": FaultSigmas(
            local_um=(1.9, 3.8),
            principal_distance_mm=0.005,
            principal_point_um=5.0,
            tilt_zero_gon=0.003,
            base_zero_mm=0.005,
            axes_um=2.0,
            rod_um=1.0,
            carriage_scale_ppm=5.0,
            carriage_skew_ppm=5.0,
            carriage_periodic_um=0.5,
            setting_mm=0.001,
            setting_gon=0.0005,
            backlash_mm=0.002,
            backlash_gon=0.001,
            carriage_backlash_mm=0.002,
            counter_slip_share=0.0,
        ),
        "serviced": FaultSigmas(
            local_um=(4.2, 6.0),
            principal_distance_mm=0.01,
            principal_point_um=10.0,
            tilt_zero_gon=0.01,
            base_zero_mm=0.01,
            axes_um=5.0,
            rod_um=3.0,
            carriage_scale_ppm=10.0,
            carriage_skew_ppm=10.0,
            carriage_periodic_um=1.5,
            setting_mm=0.002,
            setting_gon=0.001,
            backlash_mm=0.005,
            backlash_gon=0.003,
            carriage_backlash_mm=0.004,
            counter_slip_share=0.0,
        ),
        "worn": FaultSigmas(
            local_um=(8.5, 11.5),
            principal_distance_mm=0.03,
            principal_point_um=30.0,
            tilt_zero_gon=0.05,
            base_zero_mm=0.05,
            axes_um=15.0,
            rod_um=10.0,
            carriage_scale_ppm=30.0,
            carriage_skew_ppm=30.0,
            carriage_periodic_um=6.0,
            setting_mm=0.005,
            setting_gon=0.003,
            backlash_mm=0.03,
            backlash_gon=0.02,
            carriage_backlash_mm=0.03,
            counter_slip_share=5e-6,
        ),
    }
)


def draw_condition(instrument: Instrument, seed: int) -> Condition:
    """Return the complete condition of the instrument of a scenario, with the faults that a seed draws.

    The faults have random numbers of their own: the placement of pictures does not depend on the class of maintenance.
    """
    stated = instrument.condition
    listed = Condition(upkeep=stated) if isinstance(stated, str) else stated
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(INSTRUMENT_STREAM, _FAULTS)))
    total: Condition = _on_top(_drawn(FAULT_SIGMAS[listed.upkeep], rng), listed) if listed.upkeep else listed
    left, right = (_with_pattern(each, rng) for each in (total.left, total.right))
    return msgspec.structs.replace(total, left=left, right=right)


def zero_error(condition: Condition, name: str) -> float:
    """Return the offset of an element's shaft from its drum reading, mm or gon."""
    if name == "bx":
        return condition.bx_zero_mm
    if name == "common_phi":
        return condition.common_phi_zero_gon
    projector = condition.left if name.endswith("1") else condition.right
    return {
        "c": projector.principal_distance_mm,
        "kappa": projector.kappa_zero_gon,
        "phi": projector.phi_zero_gon,
        "omega": projector.omega_zero_gon,
        "by": projector.by_zero_mm,
        "bz": projector.bz_zero_mm,
    }[name[:-1]]


def local_coefficients(projector: ProjectorCondition) -> Array | None:
    """Return the coefficients ``(2, k)`` in mm of a projector's local errors, None without any."""
    if not projector.local_um:
        return None
    return 1e-3 * projector.local_um * smooth_local_errors(np.random.default_rng(projector.local_pattern or 0))


def _with_pattern(projector: ProjectorCondition, rng: np.random.Generator) -> ProjectorCondition:
    pattern = int(rng.integers(_PATTERNS))
    if projector.local_pattern is not None:
        return projector
    return msgspec.structs.replace(projector, local_pattern=pattern)


def _drawn(faults: FaultSigmas, rng: np.random.Generator) -> Condition:
    def three(sigma: float) -> tuple[float, float, float]:
        x, y, z = sigma * rng.standard_normal(3)
        return float(x), float(y), float(z)

    def projector() -> ProjectorCondition:
        kappa, phi, omega = three(faults.tilt_zero_gon)
        by, bz, _ = three(faults.base_zero_mm)
        x, y, _ = three(faults.principal_point_um)
        rod_x, rod_y, _ = three(faults.rod_um)
        return ProjectorCondition(
            principal_distance_mm=three(faults.principal_distance_mm)[0],
            principal_point_um=(x, y),
            kappa_zero_gon=kappa,
            phi_zero_gon=phi,
            omega_zero_gon=omega,
            by_zero_mm=by,
            bz_zero_mm=bz,
            axes_um=three(faults.axes_um),
            rod_um=(rod_x, rod_y),
            local_um=float(rng.uniform(*faults.local_um)),
        )

    bx, _, _ = three(faults.base_zero_mm)
    phi, _, _ = three(faults.tilt_zero_gon)
    size = faults.carriage_periodic_um
    x, y, z = rng.uniform(0.0, 400.0, 3)
    return Condition(
        left=projector(),
        right=projector(),
        bx_zero_mm=bx,
        common_phi_zero_gon=phi,
        carriage_scale_ppm=three(faults.carriage_scale_ppm),
        carriage_skew_ppm=three(faults.carriage_skew_ppm),
        carriage_periodic_um=(size, size, size),
        carriage_periodic_phase_gon=(float(x), float(y), float(z)),
        setting_sigma_mm=faults.setting_mm,
        setting_sigma_gon=faults.setting_gon,
        backlash_mm=faults.backlash_mm,
        backlash_gon=faults.backlash_gon,
        carriage_backlash_mm=faults.carriage_backlash_mm,
        counter_slip_share=faults.counter_slip_share,
    )


def _on_top(drawn: Any, listed: Any) -> Any:
    """Return the sum of two tables of faults."""
    if isinstance(drawn, tuple):
        return tuple(_on_top(*each) for each in zip(drawn, listed, strict=True))
    if isinstance(drawn, msgspec.Struct):
        names = drawn.__struct_fields__
        return type(drawn)(**{name: _on_top(getattr(drawn, name), getattr(listed, name)) for name in names})
    return listed if drawn is None else drawn + listed
