"""A drive through the pillar room, for the tests of the whole filter."""

import pytest

from amcl_world import START, moved, pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import Pose2D

STEPS = 26


@pytest.fixture(scope='session')
def drive():
    """Around a circle and on: (true base pose, base in odom, exact scan) of each step."""
    true_pose, odom_pose, steps = START, Pose2D(4.0, -3.0, 0.5), []
    for _ in range(STEPS):
        steps.append((true_pose, odom_pose, simulated_scan(pillar_room(), true_pose)))
        true_pose = moved(true_pose, 0.3, 0.42)
        odom_pose = moved(odom_pose, 0.297, 0.415)
    return steps
