"""The scene: ground, flight and photographs, the truth that never crosses the link."""

from a7sim.scene.photograph import NamedPoints, Photograph
from a7sim.scene.world import PICTURES, ExposureStation, RelativeTruth, Scene, SharedScene, build_scene

__all__ = [
    "PICTURES",
    "ExposureStation",
    "NamedPoints",
    "Photograph",
    "RelativeTruth",
    "Scene",
    "SharedScene",
    "build_scene",
]
