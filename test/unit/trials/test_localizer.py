"""Localization in lockstep: scans between odometry messages, and scans that nothing can be localized by."""

import logging

from diff_encoder_sim.drives.trial_definition import Outcome
from lockstep_trials import HALL, blind, distance_and_turn, goal_of, lockstep


def test_scans_between_two_odometry_messages_are_localized_by_interpolation():
    """An encoder that reports at 7 Hz, about 143 ms, against scans each 100 ms."""
    reports = list(lockstep(HALL, 1024, encoder_rate=7.0).run())
    assert distance_and_turn(reports[-1].estimated_pose_in_map, goal_of(HALL))[0] < 0.06
    odometry_ns = {report.odometry.stamp_ns for report in reports if report.odometry}
    estimates_ns = {report.estimate.stamp_ns for report in reports if report.estimate}
    assert estimates_ns - odometry_ns


def test_scans_without_a_range_are_dropped_with_one_warning_and_the_robot_stops_and_goes_on(caplog):
    """As live: AMCL uses none, so its transform grows old. In a wide hall none returns from near enough."""
    caplog.set_level(logging.WARNING, 'diff_encoder_sim.trials')
    trial, speeds_mps = lockstep(HALL), []
    scan_of_world, blinded = trial._simulator.scan, [False]
    trial._simulator.scan = lambda: blind(scan_of_world()) if blinded[0] else scan_of_world()
    for report in trial.run():
        now_s = report.stamp_ns * 1e-9
        blinded[0] = 2.0 <= now_s < 5.0
        if 3.5 <= now_s < 5.0:
            speeds_mps.append(report.odometry.linear_velocity_mps)
            assert report.navigation.text.startswith('stopped: localization (map->odom) is')
    assert len(speeds_mps) == 30 and max(speeds_mps) == 0.0
    assert trial.ending.outcome is Outcome.SUCCEEDED
    assert len([record for record in caplog.records if 'scan dropped' in record.getMessage()]) == 1
