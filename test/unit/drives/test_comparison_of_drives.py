"""Odometry against references: all draws at once, sensors off the axle with a delay, references without yaw."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries, wrap_angles
from diff_encoder_sim.drives.comparison import Comparison, SensorPlace, drawn_paths, of_reference
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import ReportParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

SECOND_NS = 10**9
RADIUS_M, SPEED_MPS = 2.0, 0.5
LEFT_M, RIGHT_M = (0.1 * SPEED_MPS / 0.1 * (1.0 + side * 0.2 / RADIUS_M) for side in (-1, 1))  # 0.4 m apart
PLACE = SensorPlace(Pose2D(-0.2, 0.1, 0.4), 0.13)


def base_poses(times_s):
    """On a circle to the left."""
    yaws_rad = np.asarray(times_s) * SPEED_MPS / RADIUS_M
    return np.column_stack((RADIUS_M * np.sin(yaws_rad), RADIUS_M * (1.0 - np.cos(yaws_rad)), wrap_angles(yaws_rad)))


def camera(rate_hz, place=PLACE, has_yaw=True, seed=None):
    """A reference of a sensor on the robot, whose stamps are late by its delay; its frame is anywhere."""
    stamps_ns = np.arange(int(0.4e9), int(29e9), int(1e9 / rate_hz))
    poses = []
    for pose in base_poses(1e-9 * stamps_ns - place.delay_s):
        poses.append(Pose2D(3.0, -1.0, 2.0).compose(Pose2D(*pose)).compose(place.pose))
    poses = np.array(poses) + (0.0 if seed is None else np.random.default_rng(seed).normal(0.0, 0.02, (len(poses), 3)))
    poses[:, 2] = wrap_angles(poses[:, 2]) if has_yaw else math.nan
    return Reference('camera', stamps_ns, poses)


def run(draws, **params):
    times_s = np.arange(0.0, 30.0, 0.01)
    angles_rad = np.outer(times_s, np.array([LEFT_M, RIGHT_M]) / 0.1)
    phases_rad = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, (draws, 2))
    encoder, odometry = EncoderParams(ppr=90, **params), OdometryParams(ppr=90)
    recorded = Drive((1e9 * times_s).round().astype(np.int64), angles_rad)
    rows = Chain(encoder, odometry).run(recorded, phases_rad[:1]).rows[0]
    return list(drawn_paths(encoder, odometry, recorded, phases_rad, None, rows))


def exact_path():
    stamps_ns = np.arange(0, 30 * SECOND_NS, SECOND_NS // 20)
    return PoseSeries(stamps_ns, base_poses(1e-9 * stamps_ns))


@pytest.mark.parametrize('rate_hz', [4.0, 20.0, 100.0])
@pytest.mark.parametrize('has_yaw', [True, False])
def test_a_late_sensor_off_the_axle_shows_the_path_of_the_robot(rate_hz, has_yaw):
    comparison = of_reference([camera(rate_hz, has_yaw=has_yaw)], PLACE, True)
    error = comparison.errors([exact_path()]).first
    assert error.ate_max_m < 2e-4 and error.poses > 28 * min(rate_hz, 20.0)
    assert error.yaw_rmse_rad < 1e-4 if has_yaw else math.isnan(error.yaw_rmse_rad)


@pytest.mark.parametrize('params', [{}, {'report': ReportParams(jitter=0.002, latency=0.01, latency_spread=0.005)}])
@pytest.mark.parametrize('place', [SensorPlace(), PLACE])
@pytest.mark.parametrize('has_yaw', [True, False])
def test_each_draw_has_the_errors_that_it_has_as_the_only_one(monkeypatch, params, place, has_yaw):
    monkeypatch.setattr('diff_encoder_sim.drives.comparison._AT_ONCE', 1300)  # two draws at a time
    comparison = of_reference([camera(7.0, place, has_yaw, seed=2)], place, is_own_clock=False)
    drawn = run(5, **params)
    alone = []
    for some in drawn:
        for poses in some.poses:
            first = comparison.errors([PoseSeries(some.stamps_ns, poses)]).first
            alone.append([first.ate_rmse_m, math.hypot(*first.end[:2]), abs(first.end.yaw_rad)])
    path = PoseSeries(drawn[0].stamps_ns, drawn[0].poses[0])
    spreads = comparison.errors([path], 5, [drawn]).spreads
    expected = np.percentile(alone, [50.0, 5.0, 95.0], axis=0).T
    found = np.array([spreads[name] for name in ('ate_m', 'end_position_m', 'end_yaw_rad')])
    assert found == pytest.approx(expected, rel=1e-9, nan_ok=True)
    assert len(alone) == 5 and len({round(ate_m, 12) for ate_m, *_ in alone}) == 5


def test_several_parts_count_as_one_drive():
    reference, drawn = camera(20.0, SensorPlace(), seed=3), run(3)
    one, two = (Comparison('r', [PoseSeries(*reference[1:3])] * parts) for parts in (1, 2))
    path = PoseSeries(drawn[0].stamps_ns, drawn[0].poses[0])
    once, twice = one.errors([path], 3, [drawn]), two.errors([path, path], 3, [drawn, drawn])
    assert twice.spreads['ate_m'] == pytest.approx(once.spreads['ate_m'])
    assert twice.first.poses == 2 * once.first.poses


def test_a_rotated_path_without_yaw_is_fitted_and_a_bent_one_keeps_its_residual():
    """A line against one with a kink in its middle by a small angle a: the root mean square is L a / (4 sqrt 12)."""
    length_m, kink_rad, stamps_ns = 10.0, 0.02, np.arange(0, 101 * 10**8, 10**8)
    x_m = np.linspace(-0.5 * length_m, 0.5 * length_m, 101)
    line = PoseSeries(stamps_ns, np.column_stack((x_m, np.zeros((101, 2)))))
    kinked = np.column_stack((x_m, 0.5 * kink_rad * np.abs(x_m), np.full(101, math.nan)))
    turned = kinked[:, :2] @ np.array([[0.0, 1.0], [-1.0, 0.0]]) + 7.0
    comparison = Comparison('r', [PoseSeries(stamps_ns, np.column_stack((turned, kinked[:, 2])))])
    error = comparison.errors([line]).first
    assert error.ate_rmse_m == pytest.approx(length_m * kink_rad / (4.0 * math.sqrt(12.0)), rel=0.03)
    assert all(of_length.segments == 0 for by_length in error.rpe.values() for of_length in by_length.values())


def test_paths_without_common_stamps_have_no_errors():
    late = PoseSeries(np.array([10**12, 2 * 10**12]), np.zeros((2, 3)))
    assert Comparison('r', [late]).errors([exact_path()]) is None
    assert Comparison('r', [late], SensorPlace(IDENTITY, 0.0), True).errors([exact_path()], 2, [run(2)]) is None
