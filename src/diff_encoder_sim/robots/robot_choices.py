"""What a user says about a robot, in place of what would be found out."""

from __future__ import annotations

from typing import NamedTuple, Optional


class RobotChoices(NamedTuple):
    """Overrides of describing.describe; None: find out."""

    left_joint: Optional[str] = None
    right_joint: Optional[str] = None
    laser_link: Optional[str] = None
    wheel_diameter: Optional[float] = None  # [m]
    wheel_separation: Optional[float] = None  # [m]
