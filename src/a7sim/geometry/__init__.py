"""Pure functions of projective geometry on component-first arrays.

Axes: X along the base, Y away from the operator, Z up, right-handed, millimetres. A picture is at z = -c of its camera.
Angles are radians here and gon everywhere else. An array of points has shape ``(3, ...)``, one of image points ``(2,
...)``, one of rotations ``(3, 3, ...)``: the same call serves one point and ten thousand sessions.
"""

from a7sim.geometry._atmosphere import (
    EARTH_RADIUS_M,
    lowered_by_curvature,
    radially_displaced,
    refracted,
    refraction_constant,
)
from a7sim.geometry._parallax import (
    PARALLAX_ELEMENTS,
    near_vertical_parallax_coefficients,
    parallax_coefficients,
    y_parallax,
)
from a7sim.geometry._rays import (
    at_level,
    image_of,
    ray_of,
    stereoscopic_intersection,
)
from a7sim.geometry._rotation import (
    GON,
    Array,
    angle_between,
    angles_of,
    dots,
    length_of,
    mxm,
    mxv,
    plane_rotation,
    rotation,
    transposed,
    turn_of,
)

__all__ = [
    "EARTH_RADIUS_M",
    "GON",
    "PARALLAX_ELEMENTS",
    "Array",
    "angle_between",
    "angles_of",
    "at_level",
    "dots",
    "image_of",
    "length_of",
    "lowered_by_curvature",
    "mxm",
    "mxv",
    "near_vertical_parallax_coefficients",
    "parallax_coefficients",
    "plane_rotation",
    "radially_displaced",
    "ray_of",
    "refracted",
    "refraction_constant",
    "rotation",
    "stereoscopic_intersection",
    "transposed",
    "turn_of",
    "y_parallax",
]
