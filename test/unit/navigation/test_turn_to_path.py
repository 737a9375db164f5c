"""A plan that begins behind the robot."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.goal_stopping import LOOKAHEAD_M, Motion, TurnToPath, bearing_ahead
from dwa_scoring import scored
from navigation_scenes import PERIOD_S, dwa_params, local_costmap, straight_plan, winding_plan


def test_the_dwa_alone_does_not_turn_round_but_turn_to_path_does():
    plan = straight_plan(1.4, math.pi)
    planner = DwaPlanner(dwa_params(), PERIOD_S)
    result = scored(planner, local_costmap(), plan, twist=(0.0, 0.0))
    on_the_spot = result.samples[:, 0] == 0.0
    fastest = on_the_spot & (np.abs(result.samples[:, 1]) > 0.24)
    slowest = on_the_spot & (np.abs(result.samples[:, 1]) < 0.05) & (result.totals >= 0.0)
    assert result.totals[fastest].min() > result.totals[slowest].min()
    turn = TurnToPath(dwa_params(), PERIOD_S)
    still = Motion(Pose2D(0.0, 0.0, 0.1), 0.0, 0.0)
    assert turn.command(still, plan, lambda *_: True) == (0.0, pytest.approx(0.245))
    assert turn.command(still, plan, lambda *_: False) is None
    turned = Motion(Pose2D(0.0, 0.0, math.pi - 0.9), 0.0, 1.0)
    assert turn.command(turned, plan, lambda *_: True) is None
    assert TurnToPath(dwa_params(turn_to_path_angle=0.0), PERIOD_S).command(still, plan, lambda *_: True) is None


def test_the_bearing_is_that_of_the_first_point_far_enough_from_the_nearest():
    random = np.random.default_rng(7)
    for points in (1, 2, 10, 60):
        plan = winding_plan(random, points)
        x_m, y_m = random.normal(0.0, 0.3, 2)
        nearest = int(np.argmin(np.hypot(plan[:, 0] - x_m, plan[:, 1] - y_m)))
        travelled_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(plan[nearest:, :2], axis=0).T)))
        far = np.flatnonzero(travelled_m >= LOOKAHEAD_M)
        ahead = plan[nearest + far[0] if len(far) else -1]
        assert bearing_ahead(plan, x_m, y_m) == math.atan2(ahead[1] - y_m, ahead[0] - x_m)
