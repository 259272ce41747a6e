"""Sequences with known motion: bodies given by signed distances, moved by closed-form maps, meshed anew on every frame."""

from .bodies import Sequence
from .depth_camera import DepthCamera, camera_before
from .sequences import SEQUENCES

__all__ = ["SEQUENCES", "DepthCamera", "Sequence", "camera_before"]
