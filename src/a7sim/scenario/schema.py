"""What a scenario file may say, as frozen data with units, ranges and sources.

Every description completes the sentence "expected ...": validation and the JSON Schema both read it.
"""

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from a7sim.mistakes import Mistake

SCHEMA_VERSION = 1

Text = Annotated[str, Meta(min_length=1, max_length=64, description="a text of 1 to 64 characters")]
FORMAT_MM = 230.0
"""Side of the picture."""

HALF_WIDTH_MM = 85.0
"""Distance of the outer rows of standard points from the base where nobody says otherwise."""

Name = Annotated[
    str,
    Meta(
        min_length=1,
        max_length=64,
        pattern=r"^[ !#-~]+$",
        description="a name of 1 to 64 ASCII characters without double quotes",
    ),
]
"""What goes over the link as a name."""

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


class _Data(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Frozen data read from a file; unknown keys are mistakes."""


class Fiducial(_Data, frozen=True, kw_only=True):
    """A fiducial mark by its calibrated place."""

    name: Name
    x: PictureMm
    y: PictureMm


class Camera(_Data, frozen=True, kw_only=True):
    """A calibrated taking camera."""

    name: Name = "RC5"
    c: Annotated[float, Meta(ge=98, le=215, description="a principal distance of 98 to 215 mm")]
    principal_point: tuple[OffsetMm, OffsetMm] = (0.0, 0.0)
    """mm, the calibrated principal point from the fiducial centre."""
    fiducials: Annotated[list[Fiducial], Meta(min_length=4, max_length=8, description="four or eight fiducials")]
    distortion: Annotated[list[float], Meta(max_length=4, description="up to four radial coefficients")] = []
    """k1, k2, ... of the outward displacement k1 r^3 + k2 r^5 + ..., r and result in mm."""


class Film(_Data, frozen=True, kw_only=True):
    """How film and pricking deform the imaged coordinates; standard deviations are drawn anew per photograph."""

    shrinkage_ppm: tuple[Ppm, Ppm] = (0.0, 0.0)
    """Shrinkage of every photograph in x and y."""
    shrinkage_sigma_ppm: Sigma = 0.0
    """Spread of the shrinkage between photographs."""
    shear_sigma_ppm: Sigma = 0.0
    """Spread of the departure from a right angle."""
    irregular_um: Sigma = 0.0
    """Irregular deformation at a point, each coordinate."""
    identification_um: Sigma = 0.0
    """Identity of a point from one photograph to the next, each coordinate."""


class Measured(_Data, frozen=True, kw_only=True):
    """Image coordinates that somebody measured: the photograph comes from a file."""

    file: Annotated[str, Meta(min_length=1, max_length=255, description="a file name of 1 to 255 characters")]
    photo: Name | None = None
    """Its name in the file's `photo` column; by default the photograph's own."""
    side: Literal["left", "right"] | None = None
    """Which half of a pair file (`point,xl,yl,xr,yr`) it is."""
    units: Literal["mm", "counts"] = "mm"
    """mm refined to the fiducial axes, or comparator counts with the camera's fiducials among the points."""
    count_mm: Annotated[float, Meta(gt=0, le=1, description="mm a count, above 0 to 1")] | None = None
    """Size of a count; taken from the fiducials when absent, which hides any uniform film shrinkage."""


class Photo(_Data, frozen=True, kw_only=True):
    """A photograph: where it was taken from, or the file of its measured image coordinates."""

    name: Name
    position: tuple[Metres, Metres, Metres] | None = None
    """East, north, height of the projection centre in m."""
    omega: Gon = 0.0
    phi: Gon = 0.0
    kappa: Gon = 0.0
    measured: Measured | None = None
    polarity: Literal["positive", "negative"] = "positive"
    laid: Literal["right way up", "upside down"] = "right way up"
    """How the picture was laid in its carrier; upside down is a slip for training."""


class Terrain(_Data, frozen=True, kw_only=True):
    """Rolling ground about a mean height."""

    mean_height: Metres = 0.0
    relief: Annotated[float, Meta(ge=0, le=4000, description="metres of relief, 0 to 4000")] = 0.0
    """The heights stay within mean_height -+ relief."""
    wavelength: Annotated[float, Meta(gt=0, le=1e6, description="a wavelength in metres above 0")] = 800.0
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] = 0


class Air(_Data, frozen=True, kw_only=True):
    """Departures of the rays from straight lines over a plane, as switches."""

    earth_curvature: bool = False
    refraction: bool = False


class GroundPoint(_Data, frozen=True, kw_only=True):
    """A signalised ground point; without Z it stands on the terrain."""

    point: Name
    X: Metres
    Y: Metres
    Z: Metres | None = None
    role: Literal["control", "plan", "height", "check"] = "check"


class Published(_Data, frozen=True, kw_only=True):
    """A relative orientation that others published, to stand beside the instrument's."""

    omega: Gon
    phi: Gon
    kappa: Gon
    """Turns the right photograph's camera vectors into the left photograph's frame."""
    base: tuple[float, float, float]
    """Left to right centre in the left photograph's frame, any length."""
    sigma_omega: Sigma = 0.0
    sigma_phi: Sigma = 0.0
    sigma_kappa: Sigma = 0.0
    sigma_by: Sigma = 0.0
    sigma_bz: Sigma = 0.0
    """gon, and mm at the given length of the base."""
    source: Text = "the scenario"


class Model(_Data, frozen=True, kw_only=True):
    """Two photographs to be set up as a model."""

    name: Name
    left: Name
    right: Name
    base: Literal["inside", "outside"] = "inside"
    standard_points: dict[str, Name] | None = None
    """Position (1-6, a-i) to point name; generated on the terrain when absent."""
    published: Published | None = None


class ProjectorCondition(_Data, frozen=True, kw_only=True):
    """Faults of one projector, zero for a faultless one."""

    principal_distance_mm: OffsetMm = 0.0
    principal_point_um: tuple[SmallUm, SmallUm] = (0.0, 0.0)
    kappa_zero_gon: OffsetMm = 0.0
    phi_zero_gon: OffsetMm = 0.0
    omega_zero_gon: OffsetMm = 0.0
    by_zero_mm: OffsetMm = 0.0
    bz_zero_mm: OffsetMm = 0.0
    axes_um: tuple[SmallUm, SmallUm, SmallUm] = (0.0, 0.0, 0.0)
    """By how much the tilt axes miss the projection centre, in the camera's axes."""


class Condition(_Data, frozen=True, kw_only=True):
    """The state of maintenance of an instrument; all zero is a faultless one (never true)."""

    left: ProjectorCondition = ProjectorCondition()
    right: ProjectorCondition = ProjectorCondition()
    bx_zero_mm: OffsetMm = 0.0
    carriage_scale_ppm: tuple[Ppm, Ppm, Ppm] = (0.0, 0.0, 0.0)
    """Scale errors of the X, Y and Z spindles."""
    carriage_skew_ppm: tuple[Ppm, Ppm, Ppm] = (0.0, 0.0, 0.0)
    """Departures from right angles of XY, XZ and YZ."""
    setting_sigma_mm: Sigma = 0.0
    setting_sigma_gon: Sigma = 0.0
    """Setting error of the element spindles, drawn at every setting."""
    backlash_mm: Sigma = 0.0
    backlash_gon: Sigma = 0.0
    """Play of the element spindles."""
    carriage_backlash_mm: Sigma = 0.0
    """Play of the X, Y and Z spindles."""


class GridTest(_Data, frozen=True, kw_only=True):
    """What the last adjustment of an A8 left in it, drawn anew for every session (docs/decisions/0005-a8-strip.md)."""

    local_um: Sigma = 5.5
    """Standard error of a grid test of either projector, each coordinate at photo scale (A7, A8: 4 to 7)."""
    local: Literal["smooth", "scattered"] = "smooth"
    """Local errors belong to the place in the projector, the same in every model, or come anew at every point."""
    principal_distance_mm: Sigma = 0.01
    principal_point_mm: Sigma = 0.01
    """Each coordinate; both known within 0.01 to 0.02 mm."""


class Instrument(_Data, frozen=True, kw_only=True):
    """Which plotter stands in the room, and in what state."""

    variant: Literal["A7", "A8"] = "A7"
    serial: Name = "3268"
    condition: Condition = Condition()
    """Of an A7."""
    grid_test: GridTest = GridTest()
    """Of an A8."""
    laying_sigma_mm: Sigma = 0.3
    laying_sigma_gon: Sigma = 0.2
    """How far from centred a picture lies when it is put on its carrier by hand."""


class Observer(_Data, frozen=True, kw_only=True):
    """The person in the chair. um are at photo scale; sources in docs/decisions/0004-observer.md."""

    parallax_um: Sigma = 4.0
    """One setting of by on vanishing y-parallax (surveys: 2.2 to 5.7)."""
    monocular_um: Sigma = 4.0
    """One monocular pointing, each coordinate (geometry.md; the thesis's twenty centres ask for 2.8)."""
    stereo_um: Sigma = 4.0
    """One stereoscopic pointing in plan, each coordinate."""
    height_um: Sigma = 3.0
    """One setting of the mark on the ground, as x-parallax."""
    repeat_share: Share = 0.4
    """Share of a pointing's error that is new when the pointing is repeated at once; the rest is how the
    point itself is seen. Double pointings agree within 0.01 mm (thesis 3.5) only if this is well below one."""
    fiducial_um: Sigma = 10.0
    """Registering a fiducial against its collimating mark under the magnifier."""
    last_digit_slip: Share = 0.002
    """Share of readings whose last digit is read one off."""
    blunder_rate: Share = 0.003
    """Share of readings with a gross slip (a wrong digit further up)."""
    seconds_to_look: Seconds = 2.0
    seconds_to_turn: Seconds = 2.5
    seconds_to_read: Seconds = 3.0
    seconds_to_set: Seconds = 12.0
    seconds_to_drive: Seconds = 15.0
    seconds_to_mount: Seconds = 300.0
    seconds_to_compute: Seconds = 900.0
    """Pace: estimates of the trade, no source at hand; to compute is one least-squares solution by calculator."""

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


class Plan(_Data, frozen=True, kw_only=True):
    """The settings and the procedure on the operator's job sheet."""

    method: Literal["independent", "dependent"] = "independent"
    case: Literal["A", "B", "C", "D", "E"] = "A"
    bx: Annotated[float, Meta(ge=10, le=280, description="a base of 10 to 280 mm")]
    projection_height: Annotated[float, Meta(ge=140, le=490, description="a projection height of 140 to 490 mm")]
    height_gear: (
        Annotated[float, Meta(gt=0, le=100, description="counter units a mm, above 0 to 100")]
        | Literal["Bd", "Dc", "Cd"]
    ) = 8.0
    """Units of the Z counter a mm; 8 is this project's assumption (geometry.md, Gears)."""
    plan_gear: Name = "1-2-1"
    preset: tuple[Reading, Reading, Reading] = (5000.0, 5000.0, 5000.0)
    """What X, Y and Z shall show at point 1."""
    centre_levels: tuple[Reading, Reading] = (4900.0, 5100.0)
    """Z-counter readings for the perspective centres."""
    parallax_readings: Annotated[int, Meta(ge=1, le=20, description="1 to 20 readings")] = 3
    tolerated_parallax_um: Sigma = 40.0
    """Rms of the residual y-parallaxes at photo scale beyond which a model does not fit (17 answers: 10 to 40)."""
    tolerated_centre_rms: Sigma = 0.5
    """Rms of a perspective centre beyond which its pointings do not meet (the thesis's largest is 0.187)."""
    half_width: Annotated[float, Meta(ge=5, le=115, description="5 to 115 mm")] = HALF_WIDTH_MM
    """Distance of the outer rows of standard points from the base, mm in the photograph."""


class Comparator(_Data, frozen=True, kw_only=True):
    """A comparator, and how its readings become models."""

    kind: Literal["mono", "stereo"] = "mono"
    """Every photograph by itself, with `observer.monocular_um`; or in pairs, the left image with `observer.stereo_um`
    and the right one from it by parallaxes: px with `observer.height_um`, py with `observer.parallax_um`. Fiducials
    are pointed at monocularly in both."""
    pointings: Annotated[int, Meta(ge=1, le=20, description="1 to 20 pointings")] = 2
    """Of every fiducial and point; the mean counts (thesis 3.5 points twice)."""
    least_count_um: Annotated[float, Meta(ge=0, le=100, description="micrometres, 0 (not rounded) to 100")] = 1.0
    """The Wild STK1 reads to 1 um."""
    fit: Literal["conformal", "affine"] = "affine"
    """Interior orientation on the fiducials; P eliminates film shrinkage by a linear transformation."""
    case: Literal["A", "B", "C", "D", "E"] = "A"
    """Standard points that are measured, beside the ground points; pairs are oriented on all they have in common."""
    orientation: Literal["coplanarity", "schut", "parallax"] = "coplanarity"
    """P 1.1-1.8, S equations 2 to 5, or the y-parallax equations of thesis 2.34, iterated."""


class StripPlan(_Data, frozen=True, kw_only=True):
    """How models become a strip on the ground, whoever measured them."""

    join: Literal["points", "centre", "heights"] = "points"
    """On all common points and the common centre (P 2.1-2.7), about the centre (T 2.35-2.39), scaled by heights (S)."""
    polynomial: Literal[2, 3] | None = None
    """Degree of the adjustment on the control after absolute orientation; none when absent."""


Way = Literal["plotter", "comparator"]
"""How a strip is measured."""


class Scenario(_Data, frozen=True, kw_only=True):
    """A flight, a camera, photographs, an instrument with its faults and an operator with theirs."""

    schema_version: Literal[1]
    title: Text
    story: str = ""
    camera: Camera
    film: Film = Film()
    photos: Annotated[list[Photo], Meta(min_length=2, description="two photographs or more")]
    terrain: Terrain = Terrain()
    air: Air = Air()
    ground: list[GroundPoint] = []
    models: Annotated[list[Model], Meta(min_length=1, description="one model or more")] = []
    """When absent, each photograph and the next, numbered from 1."""
    work: Annotated[list[Way], Meta(min_length=1, description="'plotter' or 'comparator' or both")] = field(
        default_factory=lambda: ["plotter"]
    )
    """Who measures the strip."""
    instrument: Instrument = Instrument()
    observer: Observer = Observer()
    plotting: Plan | None = field(default=None, name="plan")
    """`plan` in the file; needed where somebody works at a plotter."""
    comparator: Comparator = Comparator()
    strip: StripPlan = StripPlan()
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] = 1

    @property
    def plan(self) -> Plan:
        """The job sheet of the operator at the plotter. Raises Mistake where there is none."""
        if self.plotting is None:
            raise Mistake("plan: expected the settings of a plotter, got none: the scenario is not for one")
        return self.plotting

    @property
    def half_width(self) -> float:
        """Distance of the outer rows of standard points from the base, mm in the photograph."""
        return HALF_WIDTH_MM if self.plotting is None else self.plotting.half_width
