"""What was flown and photographed: the truth, which never crosses the link."""

from a7sim.scene.photograph import Marks, Photograph
from a7sim.scene.world import PICTURES, RelativeTruth, Scene, Station, build_scene

__all__ = ["PICTURES", "Marks", "Photograph", "RelativeTruth", "Scene", "Station", "build_scene"]
