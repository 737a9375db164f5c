"""Components of a final pose error (x, y and yaw), their units and tolerances, and the required success rate."""

from __future__ import annotations

import math
from typing import NamedTuple

from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

# Texts of the final poses of a trial, by prefix of their columns in the results table. All except the last are relative
# to the goal.
MINUS_TRUTH = 'odom_minus_world'
POSES = {
    **{source.value: topic for source, topic in TOPIC_OF_SOURCE.items()},
    MINUS_TRUTH: f'{TOPIC_OF_SOURCE[PoseSource.ODOM]} minus {TOPIC_OF_SOURCE[PoseSource.WORLD]}',
}


class Quantity(NamedTuple):
    """Component of the final pose error, in the unit of tables and figures."""

    name: str  # with its unit
    axis: str  # without it
    unit: str
    component: int  # index in a pose
    scale: float  # from SI to the displayed unit
    tolerance: float  # maximum absolute error in the displayed unit

    def column(self, pose: str) -> str:
        """Return the column of the results table with this component of a pose of `POSES`, in SI units."""
        return f'{pose}_yaw_rad' if self.unit == 'deg' else f'{pose}_{self.name}'


QUANTITIES = (  # with the tolerances of the paper
    Quantity('x_m', 'x', 'm', 0, 1.0, 0.05),
    Quantity('y_m', 'y', 'm', 1, 1.0, 0.05),
    Quantity('yaw_deg', 'yaw', 'deg', 2, 180.0 / math.pi, 3.0),
)
X, Y, YAW = QUANTITIES

REQUIRED_FRACTION = 0.8  # of trials within tolerance; the 30 trials of the paper can show at most 88 %
LEVEL = 0.95  # confidence of all intervals
