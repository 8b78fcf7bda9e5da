"""What was flown and photographed: the truth, which never crosses the link."""

from a7sim.scene.photograph import Marks, Photograph
from a7sim.scene.world import PICTURES, Flight, RelativeTruth, Scene, Station, build_scene

__all__ = ["PICTURES", "Flight", "Marks", "Photograph", "RelativeTruth", "Scene", "Station", "build_scene"]
