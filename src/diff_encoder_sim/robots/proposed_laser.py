"""A place for a scanner on a robot that has none."""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.robots.added_laser import AddedLaser
from diff_encoder_sim.robots.robot_description import RobotDescription
from diff_encoder_sim.robots.robot_file import robot_file_line
from diff_encoder_sim.robots.solids import reach_m

ABOVE_M = 0.05  # above the robot's highest point, where nothing of it is in the way


def proposed_laser(description: RobotDescription) -> AddedLaser:
    """Return a scanner above the robot, on its root link."""
    top_m = max(0.0, reach_m(description.hull, np.array([0.0, 0.0, 1.0])))
    return AddedLaser(description.tree.root, (0.0, 0.0, round(top_m + ABOVE_M, 3)))


def proposed_laser_line(description: RobotDescription) -> str:
    """Return the robot file that adds it."""
    return robot_file_line(description.tree.where, laser=proposed_laser(description).place())
