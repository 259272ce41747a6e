"""The reference mesh in each frame: key points, matching, as-rigid-as-possible deformation, surface fit."""
