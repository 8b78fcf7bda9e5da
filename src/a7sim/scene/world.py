"""Scene of a scenario: ground, stations, photographs, and their true values."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import GON, Array, image_of, length_of, mxm, mxv, rotation, transposed
from a7sim.scenario.schema import Measured, ModelPlan, Photo, Published, Scenario
from a7sim.scene.camera import distorted, fiducial_places, lowered_by_curvature, refracted
from a7sim.scene.content import GroundAppearance, GroundImage, marks_image, point_sampled
from a7sim.scene.emulsion import Emulsion
from a7sim.scene.grid_plate import grid_plate
from a7sim.scene.lines import GroundLine, make_lines
from a7sim.scene.measured import measured_marks
from a7sim.scene.photograph import Content, Deformation, NamedPoints, Photograph, prick_points, select, within_format
from a7sim.scene.terrain import BoolArray, GroundSurface
from a7sim.standard_points import PLACES

FILM_STREAM, SKETCH_STREAM = 1, 2
"""Spawn keys of the scene's random numbers; the keys of instrument and operator follow."""

PICTURES = 2
"""Versions of image content.

Version 1 had sharp edges, even light, no houses and no grain; sessions recorded with it are replayed with it.
"""


@dataclass(frozen=True)
class ExposureStation:
    """Exposure station: centre ``(3,)`` in m, rotation ``(3, 3)`` of camera vectors to the ground."""

    centre: Array
    rotation: Array


@dataclass(frozen=True)
class RelativeTruth:
    """Orientation of the right photograph relative to the left: rotation ``(3, 3)`` and base ``(3,)``."""

    rotation: Array
    base: Array
    source: str


@dataclass(frozen=True)
class Scene:
    """All true values of a scenario; no operator has access to them."""

    photographs: dict[str, Photograph]
    stations: dict[str, ExposureStation]
    ground_points: dict[str, Array]
    standard_points: dict[str, dict[str, str]]
    """Model name to position to point name; a position in water has no point."""
    other_points: tuple[str, ...]
    """Names of the signalised and the measured points that a job sheet lists beside the standard points."""
    published: dict[str, RelativeTruth]
    grid_plate: Photograph
    ground: GroundSurface
    lines: dict[str, GroundLine]
    """Roads and tracks by name."""

    @property
    def mountable(self) -> dict[str, Photograph]:
        """Photographs and grid plate that can be mounted on a carrier."""
        return self.photographs | {self.grid_plate.name: self.grid_plate}

    def relative_truth(self, model: ModelPlan) -> RelativeTruth | None:
        """Return the true (flown) or published relative orientation of a model, None if unknown."""
        if model.left in self.stations and model.right in self.stations:
            left, right = self.stations[model.left], self.stations[model.right]
            to_left = transposed(left.rotation)
            return RelativeTruth(
                mxm(to_left, right.rotation),
                mxv(to_left, right.centre - left.centre),
                "the flight",
            )
        return self.published.get(model.name)


def build_scene(scenario: Scenario, seed: int, pictures: int = PICTURES) -> Scene:
    """Return the scene of a scenario; the seed draws film and pricking. Raises A7SimError for invalid files."""
    return SharedScene.of(scenario, pictures).scene(seed)


@dataclass(frozen=True)
class _Exposure:
    """Photograph without the random effects of the film."""

    photo: Photo
    index: int
    fiducials: NamedPoints
    points: NamedPoints
    """Image positions on perfect film; the measured positions of measured photographs."""
    visible: BoolArray
    picture: Callable[[Array, NamedPoints, Emulsion | None], Content] | None
    """Image of the ground as a function of the film's affine deformation, the points on it and its emulsion;

    None for measured photographs.
    """


@dataclass(frozen=True)
class SharedScene:
    """Part of a scenario's scenes that does not depend on the seed."""

    scenario: Scenario
    pictures: int
    ground: GroundSurface
    lines: dict[str, GroundLine]
    stations: dict[str, ExposureStation]
    points: dict[str, Array]
    standard_points: dict[str, dict[str, str]]
    other_points: tuple[str, ...]
    published: dict[str, RelativeTruth]
    grid_plate: Photograph
    exposures: tuple[_Exposure, ...]

    @classmethod
    def of(cls, scenario: Scenario, pictures: int = PICTURES) -> "SharedScene":
        """Return the shared part of the scenes of a scenario. Raises A7SimError for invalid files."""
        ground, lines = GroundSurface.of(scenario.terrain), make_lines(scenario.lines)
        depicted = GroundAppearance(ground, tuple(lines.values()), None if pictures < 2 else scenario.terrain.seed)
        stations = {
            photo.name: ExposureStation(
                np.array(photo.position),
                rotation(photo.omega * GON, photo.phi * GON, photo.kappa * GON),
            )
            for photo in scenario.photos
            if photo.position is not None
        }
        points = {
            point.point: np.array(
                [point.X, point.Y, _height_of(ground, point.X, point.Y) if point.Z is None else point.Z]
            )
            for point in scenario.ground
        }
        standard: dict[str, dict[str, str]] = {}
        for model in scenario.models:
            if model.standard_points is not None:
                standard[model.name] = dict(model.standard_points)
            else:
                standard[model.name] = _lay_out_standard_points(scenario, model, stations, ground, points)
        exposures = tuple(
            _measured(scenario, photo, index, photo.measured)
            if photo.measured is not None
            else _exposed(scenario, photo, index, stations[photo.name], depicted, points)
            for index, photo in enumerate(scenario.photos)
        )
        _see_that_positions_are_measured(scenario, exposures)
        measured = [name for each in exposures if each.photo.measured is not None for name in each.points.names]
        return cls(
            scenario,
            pictures,
            ground,
            lines,
            stations,
            points,
            standard,
            tuple(dict.fromkeys([*(point.point for point in scenario.ground), *measured])),
            {model.name: _as_truth(model.published) for model in scenario.models if model.published is not None},
            _sharp_before_2(grid_plate(scenario.grid_plate, scenario.camera, scenario.photos[0].polarity), pictures),
            exposures,
        )

    def scene(self, seed: int) -> Scene:
        """Return the scene of a seed."""
        return Scene(
            {each.photo.name: _sharp_before_2(self._developed(each, seed), self.pictures) for each in self.exposures},
            self.stations,
            self.points,
            self.standard_points,
            self.other_points,
            self.published,
            self.grid_plate,
            self.ground,
            self.lines,
        )

    def _developed(self, exposure: _Exposure, seed: int) -> Photograph:
        photo = exposure.photo
        sketching = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(SKETCH_STREAM, exposure.index)))
        if exposure.picture is None:
            fiducials, points = exposure.fiducials, exposure.points
            content = marks_image(points)
        else:
            stream = (FILM_STREAM, exposure.index)
            filming = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=stream))
            deformation = Deformation.sample(self.scenario.film, filming)
            fiducials = NamedPoints(exposure.fiducials.names, deformation.of_fiducials(exposure.fiducials.xy, filming))
            imaged = NamedPoints(exposure.points.names, deformation.of_points(exposure.points.xy, filming))
            points = select(imaged, within_format(imaged.xy) & exposure.visible)
            emulsion = None if self.pictures < 2 else Emulsion(seed, stream)
            content = exposure.picture(deformation.matrix, points, emulsion)
        return Photograph(
            photo.name,
            self.scenario.camera,
            fiducials,
            points,
            prick_points(points, sketching),
            photo.polarity,
            photo.laid,
            content,
        )


def _see_that_positions_are_measured(scenario: Scenario, exposures: Sequence[_Exposure]) -> None:
    measured = {each.photo.name: each.points for each in exposures if each.photo.measured is not None}
    mistakes = [
        f"models[{index}].standard_points.{label}: expected a point measured in {side}, got {name!r}"
        for index, model in enumerate(scenario.models)
        for label, name in (model.standard_points or {}).items()
        for side in (model.left, model.right)
        if side in measured and measured[side].get(name) is None
    ]
    if mistakes:
        raise A7SimError("\n".join(mistakes))


def _height_of(ground: GroundSurface, east: float, north: float) -> float:
    return float(ground.height(np.asarray(east), np.asarray(north)))


def _as_truth(published: Published) -> RelativeTruth:
    return RelativeTruth(
        rotation(published.omega * GON, published.phi * GON, published.kappa * GON),
        np.array(published.base),
        published.source,
    )


def _lay_out_standard_points(
    scenario: Scenario,
    model: ModelPlan,
    stations: dict[str, ExposureStation],
    ground: GroundSurface,
    signalised: dict[str, Array],
) -> dict[str, str]:
    left, right = stations[model.left].centre, stations[model.right].centre
    along = (right - left)[:2]
    across = np.array([-along[1], along[0]]) / length_of(along)
    flying_height = (left[2] + right[2]) / 2.0 - ground.mean_height
    half_width = scenario.half_width * flying_height / scenario.camera.c
    names = {}
    for label, (share, row) in PLACES.items():
        east, north = left[:2] + share * along + row * half_width * across
        name = _standard_name(model, label)
        place = signalised.setdefault(name, np.array([east, north, _height_of(ground, east, north)]))
        if not ground.under_water(place[:2]):
            names[label] = name
    return names


def _standard_name(model: ModelPlan, label: str) -> str:
    """Return the name of a standard point: number of the photograph in whose nadir line it lies, and its position."""
    if label in "135":
        return f"{model.left}{label}"
    if label in "246":
        return f"{model.right}{int(label) - 1}"
    return f"{model.name}{label}"


def _measured(scenario: Scenario, photo: Photo, index: int, measured: Measured) -> _Exposure:
    fiducials, points = measured_marks(measured, photo.name, scenario.camera)
    return _Exposure(photo, index, fiducials, points, np.ones(len(points.names), dtype=bool), None)


def _exposed(
    scenario: Scenario,
    photo: Photo,
    index: int,
    station: ExposureStation,
    depicted: GroundAppearance,
    points: dict[str, Array],
) -> _Exposure:
    camera, ground = scenario.camera, depicted.ground
    places = np.array(list(points.values())).T
    visible = (places[2] < station.centre[2]) & ~ground.under_water(places[:2])
    imaging = _imaging(scenario, station, ground)

    def picture(deformation: Array, on_film: NamedPoints, emulsion: Emulsion | None) -> Content:
        return GroundImage(depicted, station.centre, station.rotation, camera, deformation, on_film, imaging, emulsion)

    imaged = NamedPoints(tuple(points), _imaged(scenario, station, imaging, places))
    return _Exposure(photo, index, NamedPoints(*fiducial_places(camera)), imaged, visible, picture)


def _sharp_before_2(photograph: Photograph, pictures: int) -> Photograph:
    if pictures >= 2 or photograph.content is None:
        return photograph
    return replace(photograph, content=point_sampled(photograph.content))


def _imaged(scenario: Scenario, station: ExposureStation, imaging: Callable[[Array], Array], points: Array) -> Array:
    if scenario.air.earth_curvature:
        points = lowered_by_curvature(points, station.centre)
    image = image_of(points, station.centre[:, None], station.rotation, scenario.camera.c)
    return imaging(image)


def _imaging(scenario: Scenario, station: ExposureStation, ground: GroundSurface) -> Callable[[Array], Array]:
    """Return the effect of air and lens on perspective images ``(2, ...)``, in mm from the fiducial centre."""

    def imaged(image: Array) -> Array:
        if scenario.air.refraction:
            image = refracted(image, scenario.camera.c, float(station.centre[2]), ground.mean_height)
        image = distorted(scenario.camera, image)
        shift = np.array(scenario.camera.principal_point).reshape((2,) + (1,) * (image.ndim - 1))
        return np.asarray(image + shift)

    return imaged
