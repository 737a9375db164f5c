"""The whole robot in lockstep on short routes: it arrives, and equal seeds give equal bits."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.localization.map_files import load_map, save_map
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import LatencyParams
from lockstep_trials import BEND, HALL, distance_and_turn, ended, goal_of, lockstep
from places import ROOT

SCAN_HEIGHT_M = 0.3


@pytest.mark.parametrize('test', [HALL, BEND], ids=['hall', 'bend'])
@pytest.mark.parametrize('ppr', [40, 4096])
def test_the_robot_ends_at_its_goal_within_tolerance_by_its_pose_estimate(test, ppr):
    *_, last = lockstep(test, ppr).run()
    goal = goal_of(test)
    # Table 2: 0.05 m, latched while it turns; 0.052 rad.
    distance_m, turn_rad = distance_and_turn(last.estimated_pose_in_map, goal)
    assert distance_m < 0.06
    assert turn_rad < 0.052
    distance_m, turn_rad = distance_and_turn(last.true_pose_in_map, goal)
    assert distance_m < 0.25
    assert turn_rad < 0.2


def test_a_map_of_another_resolution_will_do(tmp_path):
    coarse = rasterise(load_world(ROOT / 'worlds' / 'hallway.world'), SCAN_HEIGHT_M, 0.1, 0.0, 0.0)
    *_, last = lockstep(HALL, map_file=save_map(coarse, tmp_path / 'coarse')).run()
    goal = goal_of(HALL)
    assert distance_and_turn(last.estimated_pose_in_map, goal)[0] < 0.06
    assert distance_and_turn(last.true_pose_in_map, goal)[0] < 0.25


def test_reports_come_at_twenty_hertz_and_the_estimate_follows_the_truth():
    reports = list(lockstep(HALL, 1024).run())
    assert set(np.diff([report.stamp_ns for report in reports])) == {50_000_000}
    assert reports[0].estimated_pose_in_map is None
    errors = [report.estimated_pose_in_map.relative_to(report.true_pose_in_map) for report in reports[20:]]
    assert max(math.hypot(error.x_m, error.y_m) for error in errors) < 0.3


def test_the_same_trial_is_the_same_bit_for_bit_and_another_is_not():
    first, second, other = (
        [
            (
                report.true_pose_in_map,
                report.odometry.base_pose_in_odom,
                report.estimated_pose_in_map,
                report.navigation.command,
            )
            for report in lockstep(BEND, number=number).run()
        ]
        for number in (5, 5, 6)
    )
    assert first == second
    assert first != other


def test_a_trial_that_takes_too_long_fails():
    ending = ended(lockstep(HALL, time_limit=2.0))
    assert ending == (Outcome.TIMED_OUT, 'not at its end after 2 s (time_limit)')


def test_a_robot_that_runs_into_a_wall_has_collided():
    ending = ended(lockstep(HALL, nav='scripted', start={'x': 0.0, 'yaw': math.pi / 2}, drive=[{'straight': 6.0}]))
    assert ending.outcome is Outcome.COLLISION
    assert 'hallway' in ending.reason and '(0.00, 2.' in ending.reason


def test_a_robot_whose_estimate_but_not_itself_is_at_the_goal_is_lost(tmp_path):
    """Its map lies 1 m too far ahead, and so does the goal by its pose estimate."""
    grid = load_map(ROOT / 'worlds' / 'hallway.yaml')
    ahead = grid._replace(origin=grid.origin._replace(x_m=grid.origin.x_m + 1.0))
    ending = ended(lockstep(HALL, map_file=save_map(ahead, tmp_path / 'ahead')))
    assert ending.outcome is Outcome.LOST
    assert 'from the goal; allowed: 0.50 m' in ending.reason


def test_latencies_delay_what_they_say(tmp_path):
    slow = LatencyParams(odometry=0.03, localization=0.1, command=0.05)
    published = {name: [] for name in ('odometry', 'odom_in_map', 'scan')}

    class Recorder(Publications):
        def scan(self, scan):
            published['scan'].append((scan.stamp_ns, scan.stamp_ns))

        def odometry(self, now_ns, estimate):
            published['odometry'].append((now_ns, estimate.stamp_ns))

        def odom_in_map(self, now_ns, stamp_ns, odom_pose_in_map):
            published['odom_in_map'].append((now_ns, stamp_ns))

    quick, late = (lockstep(HALL, latency=latency) for latency in (LatencyParams(), slow))
    trial = lockstep(HALL, latency=slow, publications=Recorder())
    assert ended(trial).outcome is Outcome.SUCCEEDED
    assert {now_ns - stamp_ns for now_ns, stamp_ns in published['odometry']} == {30_000_000}
    # Stamped ahead by transform_tolerance, 0.4 s.
    assert {now_ns - stamp_ns for now_ns, stamp_ns in published['odom_in_map']} == {130_000_000 - 400_000_000}
    starts = [
        next(trial.time_ns for report in trial.run() if report.true_pose_in_map.x_m > -2.999) for trial in (quick, late)
    ]
    assert 0.08e9 <= starts[1] - starts[0] <= 0.3e9


def test_what_needs_the_live_graph_is_refused():
    with pytest.raises(ConfigError, match='nav upstream.*allowed: encoder; embedded or scripted'):
        lockstep(HALL, nav='upstream')
