"""Contents of a scenario file as frozen records with units, ranges and sources.

Each description completes the sentence "expected ..."; validation and the JSON Schema use it.
"""

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from msgspec import Meta, Struct, field
from msgspec.structs import replace

from a7sim.errors import A7SimError

SCHEMA_VERSION = 1

Text = Annotated[str, Meta(min_length=1, max_length=64, description="a text of 1 to 64 characters")]
FORMAT_MM = 230.0
"""Side of the picture."""

HALF_WIDTH_MM = 85.0
"""Default distance of the outer rows of standard points from the base."""

Name = Annotated[
    str,
    Meta(
        min_length=1,
        max_length=64,
        pattern=r"^[ !#-~]+$",
        description="a name of 1 to 64 ASCII characters without double quotes",
    ),
]
"""Name that the link can transmit."""

PictureMm = Annotated[float, Meta(ge=-115, le=115, description="mm within the 230 mm format")]
OffsetMm = Annotated[float, Meta(ge=-5, le=5, description="mm from -5 to 5")]
Metres = Annotated[float, Meta(ge=-1e8, le=1e8, description="metres")]
Gon = Annotated[float, Meta(ge=-400, le=400, description="gon from -400 to 400")]
SmallUm = Annotated[float, Meta(ge=-1000, le=1000, description="micrometres from -1000 to 1000")]
Sigma = Annotated[float, Meta(ge=0, le=1000, description="a standard deviation, zero or more")]
Share = Annotated[float, Meta(ge=0, le=1, description="a share from 0 to 1")]
Seconds = Annotated[float, Meta(ge=0, le=86400, description="seconds, zero or more")]
Reading = Annotated[float, Meta(ge=-999999, le=999999, description="a counter reading of at most six digits")]
Ppm = Annotated[float, Meta(ge=-5000, le=5000, description="parts per million from -5000 to 5000")]


class FileRecord(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Frozen record read from a file. An unknown key is an error."""


class Fiducial(FileRecord, frozen=True, kw_only=True):
    """Fiducial mark by its calibrated position."""

    name: Name
    x: PictureMm
    y: PictureMm


class Camera(FileRecord, frozen=True, kw_only=True):
    """Calibrated taking camera."""

    name: Name = "RC5"
    c: Annotated[float, Meta(ge=98, le=215, description="a principal distance of 98 to 215 mm")]
    principal_point: tuple[OffsetMm, OffsetMm] = (0.0, 0.0)
    """mm, calibrated principal point from the fiducial centre."""
    fiducials: Annotated[list[Fiducial], Meta(min_length=4, max_length=8, description="four or eight fiducials")]
    distortion: Annotated[list[float], Meta(max_length=4, description="up to four radial coefficients")] = []
    """k1, k2, ... of the outward displacement k1 r^3 + k2 r^5 + ..., r and result in mm."""


class FilmDeformation(FileRecord, frozen=True, kw_only=True):
    """Deformation of image coordinates by film and pricking; drawn anew for each photograph."""

    shrinkage_ppm: tuple[Ppm, Ppm] = (0.0, 0.0)
    """Shrinkage of all photographs in x and y."""
    shrinkage_sigma_ppm: Sigma = 0.0
    """Standard deviation of the shrinkage between photographs."""
    shear_sigma_ppm: Sigma = 0.0
    """Standard deviation of the departure from a right angle."""
    irregular_um: Sigma = 0.0
    """Irregular deformation at a point, each coordinate."""
    identification_um: Sigma = 0.0
    """Identification of a point from one photograph to the next, each coordinate."""


class Measured(FileRecord, frozen=True, kw_only=True):
    """Measured image coordinates: the photograph comes from a file."""

    file: Annotated[str, Meta(min_length=1, max_length=255, description="a file name of 1 to 255 characters")]
    photo: Name | None = None
    """Name in the file's `photo` column; by default the name of the photograph."""
    side: Literal["left", "right"] | None = None
    """Half of a pair file (`point,xl,yl,xr,yr`)."""
    units: Literal["mm", "counts"] = "mm"
    """mm refined to the fiducial axes, or comparator counts with the camera's fiducials among the points."""
    count_mm: Annotated[float, Meta(gt=0, le=1, description="mm a count, above 0 to 1")] | None = None
    """Size of a count; if absent it follows from the fiducials, which hides a uniform film shrinkage."""


class Photo(FileRecord, frozen=True, kw_only=True):
    """Photograph: its exposure station, or the file of its measured image coordinates."""

    name: Name
    position: tuple[Metres, Metres, Metres] | None = None
    """East, north, height of the projection centre in m."""
    omega: Gon = 0.0
    phi: Gon = 0.0
    kappa: Gon = 0.0
    measured: Measured | None = None
    polarity: Literal["positive", "negative"] = "positive"
    laid: Literal["right way up", "upside down"] = "right way up"
    """Placement of the picture in its carrier; upside down is a slip for training."""


class Water(FileRecord, frozen=True, kw_only=True):
    """Water surface: no point on it can be pricked, and its picture has no detail for the mark."""

    name: Name = "lake"
    shore: Annotated[list[tuple[Metres, Metres]], Meta(min_length=3, max_length=200, description="3 to 200 places")]
    """East and north along the closed shore."""


class Terrain(FileRecord, frozen=True, kw_only=True):
    """Rolling ground about a mean height."""

    mean_height: Metres = 0.0
    relief: Annotated[float, Meta(ge=0, le=4000, description="metres of relief, 0 to 4000")] = 0.0
    """Heights stay within mean_height -+ relief."""
    wavelength: Annotated[float, Meta(gt=0, le=1e6, description="a wavelength in metres above 0")] = 800.0
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] = 0
    water: list[Water] = []


class Air(FileRecord, frozen=True, kw_only=True):
    """Switches for the departure of rays from straight lines over a plane."""

    earth_curvature: bool = False
    refraction: bool = False


class GroundPoint(FileRecord, frozen=True, kw_only=True):
    """Signalised ground point; without Z it is on the terrain."""

    point: Name
    X: Metres
    Y: Metres
    Z: Metres | None = None
    role: Literal["control", "plan", "height", "check"] = "check"


class LinePlan(FileRecord, frozen=True, kw_only=True):
    """Visible line on the ground: a smooth curve through vertices, lighter than its surroundings."""

    name: Name
    kind: Literal["road", "track"] = "road"
    width: Annotated[float, Meta(ge=1, le=50, description="metres, 1 to 50")] = 7.0
    vertices: Annotated[list[tuple[Metres, Metres]], Meta(min_length=2, max_length=200, description="2 to 200 places")]
    """East and north."""


class Published(FileRecord, frozen=True, kw_only=True):
    """Published relative orientation for comparison with the instrument's."""

    omega: Gon
    phi: Gon
    kappa: Gon
    """Rotation of the right photograph's camera vectors into the left photograph's frame."""
    base: tuple[float, float, float]
    """From left to right centre in the left photograph's frame, any length."""
    sigma_omega: Sigma = 0.0
    sigma_phi: Sigma = 0.0
    sigma_kappa: Sigma = 0.0
    sigma_by: Sigma = 0.0
    sigma_bz: Sigma = 0.0
    """gon, and mm at the given length of the base."""
    source: Text = "the scenario"


class ModelPlan(FileRecord, frozen=True, kw_only=True):
    """Two photographs that form a model."""

    name: Name
    left: Name
    right: Name
    base: Literal["inside", "outside"] = "inside"
    standard_points: dict[str, Name] | None = None
    """Position (1-6, a-i) to point name; if absent, points are placed on dry land of the terrain."""
    published: Published | None = None


class ProjectorCondition(FileRecord, frozen=True, kw_only=True):
    """Faults of one projector, zero for a faultless one."""

    principal_distance_mm: OffsetMm = 0.0
    principal_point_um: tuple[SmallUm, SmallUm] = (0.0, 0.0)
    kappa_zero_gon: OffsetMm = 0.0
    phi_zero_gon: OffsetMm = 0.0
    omega_zero_gon: OffsetMm = 0.0
    by_zero_mm: OffsetMm = 0.0
    bz_zero_mm: OffsetMm = 0.0
    axes_um: tuple[SmallUm, SmallUm, SmallUm] = (0.0, 0.0, 0.0)
    """Distance of the tilt axes from the projection centre, in the camera's axes."""
    rod_um: tuple[SmallUm, SmallUm] = (0.0, 0.0)
    """Distance of the space rod from the centre of its gimbal along the gimbal's two axes;

    it rotates with the inclination of the rod.
    """
    local_um: Sigma = 0.0
    """Standard error of a grid test: smooth local errors of the projector, each coordinate at photo scale."""
    local_pattern: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] | None = None
    """Number of the pattern of these local errors; if absent, each seed has its own."""


MaintenanceClass = Literal["new", "serviced", "worn"]
"""Classes of maintenance (docs/decisions/0006-condition.md)."""


class Condition(FileRecord, frozen=True, kw_only=True):
    """Condition of an instrument; all zero is a faultless one (which does not exist)."""

    upkeep: MaintenanceClass | None = None
    """Class of maintenance; a seed draws its faults, and the faults listed beside it are added."""
    left: ProjectorCondition = ProjectorCondition()
    right: ProjectorCondition = ProjectorCondition()
    bx_zero_mm: OffsetMm = 0.0
    common_phi_zero_gon: OffsetMm = 0.0
    """Of an A8."""
    carriage_scale_ppm: tuple[Ppm, Ppm, Ppm] = (0.0, 0.0, 0.0)
    """Scale errors of the X, Y and Z spindles."""
    carriage_skew_ppm: tuple[Ppm, Ppm, Ppm] = (0.0, 0.0, 0.0)
    """Departures from right angles of XY, XZ and YZ."""
    carriage_periodic_um: tuple[Sigma, Sigma, Sigma] = (0.0, 0.0, 0.0)
    """Amplitude of the periodic error of the X, Y and Z spindles per turn, in the model."""
    carriage_periodic_phase_gon: tuple[Gon, Gon, Gon] = (0.0, 0.0, 0.0)
    """Phase of the periodic error."""
    setting_sigma_mm: Sigma = 0.0
    setting_sigma_gon: Sigma = 0.0
    """Setting error of the element spindles, drawn for each setting."""
    backlash_mm: Sigma = 0.0
    backlash_gon: Sigma = 0.0
    """Play of the element spindles."""
    carriage_backlash_mm: Sigma = 0.0
    """Play of the X, Y and Z spindles."""
    counter_slip_share: Share = 0.0
    """Share of the passes over zero at which the last drum of the X, Y or Z counter does not carry to the next one."""


class GridTest(FileRecord, frozen=True, kw_only=True):
    """Errors left by the last adjustment of an A8, drawn anew for each session (docs/decisions/0005-a8-strip.md)."""

    local_um: Sigma = 5.5
    """Standard error of a grid test of either projector, each coordinate at photo scale (A7, A8: 4 to 7)."""
    local: Literal["smooth", "scattered"] = "smooth"
    """Local errors belong to the position in the projector, the same in all models, or are drawn anew at each point."""
    principal_distance_mm: Sigma = 0.01
    principal_point_mm: Sigma = 0.01
    """Each coordinate; both known within 0.01 to 0.02 mm."""


class Instrument(FileRecord, frozen=True, kw_only=True):
    """Plotter and its condition."""

    variant: Literal["A7", "A8"] = "A7"
    serial: Name = "3268"
    condition: Condition | MaintenanceClass = Condition()
    """Faults as a table, or a class of maintenance by its name."""
    grid_test: GridTest = GridTest()
    """Of the A8 of an A8 strip."""
    laying_sigma_mm: Sigma = 0.3
    laying_sigma_gon: Sigma = 0.2
    """Standard deviation of the position of a picture placed on its carrier by hand."""


Skill = Literal["novice", "trained", "first-order"]
"""Profiles of operators; their numbers are in scenario/skills.py."""

SlipKind = Literal[
    "last digit",
    "gross",
    "wrong point",
    "wrong sign",
    "transposed digits",
    "forgotten lever",
    "element not re-read",
]


class PlannedSlip(FileRecord, frozen=True, kw_only=True):
    """Planned slip, made once at the first occasion that matches; an empty field matches any."""

    kind: SlipKind
    model: Annotated[str, Meta(max_length=64, description="the name of a model, or an empty text")] = ""
    form: Annotated[str, Meta(max_length=64, description="the form, such as 'relative orientation'")] = ""
    """Heading in the observation book; the heading of the fittings is 'interior orientation'."""
    point: Annotated[str, Meta(max_length=64, description="a point, fitting or element, or an empty text")] = ""
    """Name of the point; of the fitting for a forgotten fitting, of the element for a reading that is not repeated."""


class Observer(FileRecord, frozen=True, kw_only=True):
    """The operator as a person; um at photo scale. Sources: docs/decisions/0004-observer.md, 0008-operator-skill.md."""

    skill: Skill | None = None
    """Profile that gives all values that are not stated here; without a profile, the defaults below."""
    parallax_um: Sigma = 4.0
    """One setting of by on vanishing y-parallax (surveys: 2.2 to 5.7)."""
    monocular_um: Sigma = 4.0
    """One monocular pointing, each coordinate (geometry.md; the twenty centres of the thesis imply 2.8)."""
    stereo_um: Sigma = 4.0
    """One stereoscopic pointing in plan, each coordinate."""
    height_um: Sigma = 3.0
    """One setting of the mark on the ground, as x-parallax."""
    repeat_share: Share = 0.4
    """Share of the error of a pointing that is new when the pointing is repeated at once;

    the rest is the appearance of the point itself. Double pointings agree within 0.01 mm (thesis 3.5) only if this
    share is well below one.
    """
    fiducial_um: Sigma = 10.0
    """Registering a fiducial against its collimating mark under the magnifier."""
    last_digit_slip: Share = 0.002
    """Share of readings whose last digit is read one off."""
    blunder_rate: Share = 0.003
    """Share of readings with a gross slip (a wrong higher digit)."""
    wrong_point_rate: Share = 0.0
    """Share of the points at which a neighbouring standard point is measured instead."""
    wrong_sign_rate: Share = 0.0
    """Share of by readings written with the wrong sign."""
    transposed_rate: Share = 0.0
    """Share of readings with two neighbouring digits exchanged."""
    forgotten_lever_rate: Share = 0.0
    """Share of fittings left in the other position."""
    not_reread_rate: Share = 0.0
    """Share of the elements of a round for which the reading of the previous round is used."""
    certain_slips: Annotated[list[PlannedSlip], Meta(max_length=20, description="up to 20 slips")] = []
    """Planned slips, independent of the rates; each happens once."""
    warm_up: Annotated[float, Meta(ge=0, le=10, description="a share of the settings' errors, 0 to 10")] = 0.0
    """Relative increase of setting errors at the start of work; it decreases linearly to zero."""
    warm_up_minutes: Annotated[float, Meta(gt=0, le=1440, description="minutes above 0")] = 30.0
    fresh_hours: Annotated[float, Meta(ge=0, le=24, description="hours from 0 to 24")] = 1.0
    """Hours without fatigue after the start of work or after a break."""
    fatigue_per_hour: Annotated[float, Meta(ge=0, le=10, description="a share an hour, 0 to 10")] = 0.0
    """Relative increase of setting errors per hour without a break, after the fresh hours."""
    slip_fatigue_per_hour: Annotated[float, Meta(ge=0, le=10, description="a share an hour, 0 to 10")] = 0.0
    """Relative increase of slips per hour without a break, after the fresh hours."""
    takes_breaks: bool = False
    break_every_hours: Annotated[float, Meta(gt=0, le=24, description="hours above 0")] = 2.0
    """A break is taken before the next form or round if the last one is longer ago than this."""
    break_minutes: Annotated[float, Meta(ge=0, le=1440, description="minutes, zero or more")] = 15.0
    pace: Annotated[float, Meta(gt=0, le=100, description="a factor above 0 to 100")] = 1.0
    """Factor of all durations below."""
    seconds_to_look: Seconds = 2.0
    seconds_to_turn: Seconds = 2.5
    seconds_to_read: Seconds = 3.0
    seconds_to_set: Seconds = 12.0
    seconds_to_drive: Seconds = 15.0
    seconds_to_mount: Seconds = 300.0
    seconds_to_compute: Seconds = 900.0
    """Durations: estimates of the trade, no source at hand; to compute is one least-squares solution by calculator."""

    @classmethod
    def faultless(cls) -> "Observer":
        """Return an observer without any error, at the usual pace."""
        return cls(
            parallax_um=0.0,
            monocular_um=0.0,
            stereo_um=0.0,
            height_um=0.0,
            fiducial_um=0.0,
            last_digit_slip=0.0,
            blunder_rate=0.0,
        )


OBSERVER_IN_WORDS = f"{', '.join(repr(skill) for skill in get_args(Skill))} or a table"


CentreLevels = Annotated[list[Reading], Meta(min_length=2, max_length=10, description="2 to 10 counter readings")]


class Plan(FileRecord, frozen=True, kw_only=True):
    """Settings and procedure on the operator's job sheet."""

    method: Literal["independent", "dependent"] = "independent"
    """Swing-swing, or all elements of the projector with the new photograph (T 2.34, 2.33)."""
    procedure: Literal["numerical", "empirical"] = "numerical"
    """Parallaxes measured and elements computed from them, or cleared point by point."""
    solution: Literal["least squares", "hallert"] = "least squares"
    """Of the numerical procedure: Hallert's closed forms in cases A and D, if the points lie on the pattern."""
    measure_with: Literal["both", "by1", "by2"] = "both"
    """Measuring element of the numerical procedure."""
    over_correction: (
        Annotated[float, Meta(gt=0, le=5, description="how many times the turn, above 0 to 5")] | Literal["computed"]
    ) = "computed"
    """Of the last omega step of the empirical procedure; 1 clears the last point and no more."""
    start_off_gon: Annotated[float, Meta(ge=0, le=4, description="0 to 4 gon")] = 0.0
    """Maximum by which the operator perturbs the elements before starting, for practice."""
    case: Literal["A", "B", "C", "D", "E"] = "A"
    bx: Annotated[float, Meta(ge=10, le=280, description="a base of 10 to 280 mm")]
    projection_height: Annotated[float, Meta(ge=140, le=490, description="a projection height of 140 to 490 mm")]
    height_gear: (
        Annotated[float, Meta(gt=0, le=100, description="counter units a mm, above 0 to 100")]
        | Literal["Bd", "Dc", "Cd"]
    ) = 8.0
    """Units of the Z counter per mm; 8 is an assumption of this project (geometry.md, Gears)."""
    plan_gear: Name = "1-2-1"
    preset: tuple[Reading, Reading, Reading] = (5000.0, 5000.0, 5000.0)
    """Readings of X, Y and Z at point 1, or at the first standard point on dry land."""
    centre_method: Literal["two levels", "levels", "grid plate", "scales"] = "two levels"
    """Lines through points 1 to 6 at two or more levels of Z (thesis 3.6), or resection of a grid plate mounted in
    place of the picture.
    """
    centre_levels: CentreLevels = field(default_factory=lambda: [4900.0, 5100.0])
    """Z-counter readings for the perspective centres; exactly two for the method of two levels."""
    parallax_readings: Annotated[int, Meta(ge=1, le=20, description="1 to 20 readings")] = 3
    tolerated_parallax_um: Sigma = 40.0
    """Rms of the residual y-parallaxes at photo scale above which a model does not fit (17 answers: 10 to 40)."""
    tolerated_centre_rms: Sigma = 0.5
    """Rms of a perspective centre above which its pointings disagree (the largest of the thesis is 0.187)."""
    half_width: Annotated[float, Meta(ge=5, le=115, description="5 to 115 mm")] = HALF_WIDTH_MM
    """Distance of the outer rows of standard points from the base, mm in the photograph."""
    absolute_orientation: bool = False
    """Whether each model is also levelled and scaled at the instrument on its control."""


class GridPlate(FileRecord, frozen=True, kw_only=True):
    """Glass plate with crosses in equal squares for testing projectors."""

    name: Name = "grid"
    lines: Annotated[int, Meta(ge=3, le=23, description="3 to 23 lines each way")] = 9
    spacing_mm: Annotated[float, Meta(ge=5, le=100, description="5 to 100 mm")] = 25.0
    """Distance of neighbouring lines."""
    accuracy_um: Annotated[float, Meta(ge=0, le=100, description="micrometres, 0 to 100")] = 1.0
    """Standard error of each cross and fiducial mark, each coordinate [assumption; no source at hand]."""
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] = 0
    """Seed of the true positions of the crosses: the plate is the same for all flights."""

    @property
    def crosses(self) -> dict[str, tuple[float, float]]:
        """Nominal positions in mm about the middle; named G and line and column, counted from the front left corner."""
        digits = len(str(self.lines))
        at = [(i - (self.lines - 1) / 2.0) * self.spacing_mm for i in range(self.lines)]
        return {
            f"G{row:0{digits}}{column:0{digits}}": (x, y)
            for row, y in enumerate(at, start=1)
            for column, x in enumerate(at, start=1)
        }

    @property
    def even_counts(self) -> list[int]:
        """Numbers of crosses on lines evenly spaced over the whole plate, including its corners."""
        return [k * k for k in range(3, self.lines + 1) if (self.lines - 1) % (k - 1) == 0]

    def some_crosses(self, count: int) -> dict[str, tuple[float, float]]:
        """Return `count` crosses, evenly spaced over the whole plate. Raises A7SimError if no such set exists."""
        if count not in self.even_counts:
            known = ", ".join(map(str, self.even_counts))
            raise A7SimError(f"expected a number of crosses that lie evenly on the grid plate ({known}), got {count}")
        step = (self.lines - 1) // (round(count**0.5) - 1)
        crosses = list(self.crosses.items())
        return {
            name: place
            for i, (name, place) in enumerate(crosses)
            if i // self.lines % step == 0 and i % self.lines % step == 0
        }

    def certificate(self, camera: Camera) -> Camera:
        """Camera by which the plate is centred: its middle belongs under the middle of the fiducials."""
        return replace(camera, name=self.name, principal_point=(0.0, 0.0), distortion=[])


class Comparator(FileRecord, frozen=True, kw_only=True):
    """Comparator, and the computation of models from its readings."""

    kind: Literal["mono", "stereo"] = "mono"
    """Single photographs with `observer.monocular_um`;

    or pairs, the left image with `observer.stereo_um` and the right one by parallaxes: px with `observer.height_um`, py
    with `observer.parallax_um`. Fiducials are measured monocularly in both.
    """
    pointings: Annotated[int, Meta(ge=1, le=20, description="1 to 20 pointings")] = 2
    """Pointings of each fiducial and point; the mean is used (thesis 3.5 points twice)."""
    least_count_um: Annotated[float, Meta(ge=0, le=100, description="micrometres, 0 (not rounded) to 100")] = 1.0
    """The Wild STK1 reads to 1 um."""
    fit: Literal["conformal", "affine"] = "affine"
    """Interior orientation on the fiducials; P eliminates film shrinkage by a linear transformation."""
    case: Literal["A", "B", "C", "D", "E"] = "A"
    """Standard points that are measured beside the ground points; pairs are oriented on all common points."""
    orientation: Literal["coplanarity", "schut", "parallax"] = "coplanarity"
    """P 1.1-1.8, S equations 2 to 5, or the y-parallax equations of thesis 2.34, iterated."""


class StripPlan(FileRecord, frozen=True, kw_only=True):
    """Formation of a strip from models and its orientation on the ground, for all methods of measurement."""

    join: Literal["points", "centre", "heights"] = "points"
    """On all common points and the common centre (P 2.1-2.7), about the centre (T 2.35-2.39), scaled by heights (S)."""
    polynomial: Literal[2, 3] | None = None
    """Degree of the adjustment on the control after absolute orientation; none if absent."""


StripMethod = Literal["plotter", "comparator", "readings", "bridge"]
"""Method of measuring a strip:

an operator at a plotter, a comparator, an A8 as arrays of readings, or an operator who bridges it with base in and base
out in turn.
"""


_loaders: list[Callable[[Path, Mapping[str, Any] | None], "Scenario"]] = []
"""Loader of scenario files, registered by `a7sim.scenario.loading`, which imports this module."""


def register_loader(loader: Callable[[Path, Mapping[str, Any] | None], "Scenario"]) -> None:
    """Set the function behind `Scenario.load`: it takes the path of a scenario file, and settings by path."""
    _loaders[:] = [loader]


class Scenario(FileRecord, frozen=True, kw_only=True):
    """Flight, camera, photographs, an instrument with its faults and an operator with slips."""

    schema_version: Literal[1]
    title: Text
    story: str = ""
    camera: Camera
    film: FilmDeformation = FilmDeformation()
    photos: Annotated[list[Photo], Meta(min_length=2, description="two photographs or more")]
    terrain: Terrain = Terrain()
    air: Air = Air()
    ground: list[GroundPoint] = []
    lines: list[LinePlan] = []
    """Roads and tracks, shown by the photographs."""
    models: Annotated[list[ModelPlan], Meta(min_length=1, description="one model or more")] = []
    """If absent, each photograph and the next, numbered from 1."""
    work: Annotated[
        list[StripMethod], Meta(min_length=1, description="'plotter', 'comparator', 'readings' or 'bridge', or several")
    ] = field(default_factory=lambda: ["plotter"])
    """Methods of measuring the strip."""
    instrument: Instrument = Instrument()
    grid_plate: GridPlate = GridPlate()
    observer: Annotated[Observer, Meta(description=OBSERVER_IN_WORDS)] = Observer()
    plotting: Plan | None = field(default=None, name="plan")
    """`plan` in the file; required for work at a plotter."""
    comparator: Comparator = Comparator()
    strip: StripPlan = StripPlan()
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] = 1

    @classmethod
    def load(cls, name: str | PathLike[str], settings: Mapping[str, Any] | None = None) -> "Scenario":
        """Return the scenario of a file, or one that comes with a7sim, with other values by their paths.

        Raises ScenarioError, an A7SimError that lists all errors.

        >>> from a7sim import Scenario
        >>> scenario = Scenario.load("akwanga", {"plan.case": "E", "observer.parallax_um": 12})
        >>> scenario.plan.case, [model.name for model in scenario.models]
        ('E', ['1', '2'])
        """
        return _loaders[0](Path(name), settings)

    @property
    def plan(self) -> Plan:
        """Job sheet of the operator at the plotter. Raises A7SimError if there is none."""
        if self.plotting is None:
            raise A7SimError("plan: expected the settings of a plotter, got none: the scenario is not for one")
        return self.plotting

    @property
    def half_width(self) -> float:
        """Distance of the outer rows of standard points from the base, mm in the photograph."""
        return HALF_WIDTH_MM if self.plotting is None else self.plotting.half_width
