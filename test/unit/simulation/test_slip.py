"""Slip by motion, floor, spin and bumps: closed forms, repeatable, and nothing by default."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.robots.simulated_robot import TrueWheels
from diff_encoder_sim.simulation.slip import Floor, FloorArea, SlippingWheels, WheelErrorParams, extra_travel
from diff_encoder_sim.simulation.state import TICK_S
from simulated_drive import RADIUS_M, SEPARATION_M, box_world, drive

WHEELS = TrueWheels(RADIUS_M, RADIUS_M, SEPARATION_M)
START = Pose2D(-10, 0, 0)
LEFT_OF_AXIS = {'x_min': -20.0, 'x_max': 20.0, 'y_min': 0.0, 'y_max': 5.0}


def wheels_of(seed=1, **errors):
    rngs = [np.random.default_rng([seed, stream]) for stream in (0, 1)]
    return SlippingWheels(WheelErrorParams.from_mapping(errors, ''), WHEELS, *rngs)


def rolled_straight(wheels, acceleration_mps2=0.5, speed_mps=0.5, cruise_s=0.0, factors=(1.0, 1.0)):
    """Accelerate, cruise and brake; return what the wheels turn beyond rolling [m], (n, 2), and the speeds."""
    ramp = np.arange(TICK_S, speed_mps / acceleration_mps2 + 1e-9, TICK_S) * acceleration_mps2
    commands = np.concatenate((ramp, np.full(round(cruise_s / TICK_S), speed_mps), ramp[::-1], [0.0]))
    rolled_rad, extra_m, more_mps = np.zeros(2), [], []
    for speed in commands.tolist():
        rolling = np.array(wheels.rolling_speeds(speed / RADIUS_M, speed / RADIUS_M, factors))
        rolled_rad = rolled_rad + rolling * TICK_S
        extra_m.append((np.array(wheels.turned(tuple(rolled_rad.tolist()))) - rolled_rad) * RADIUS_M)
        more_mps.append((np.array(wheels.turning_speeds(*rolling.tolist())) - rolling) * RADIUS_M)
    return np.array(extra_m), np.array(more_mps)


def test_a_wheel_turns_further_by_k_a_s_on_a_ramp_and_gives_it_back_when_it_brakes():
    k, speed_mps = 0.02, 0.5
    extra_m, more_mps = rolled_straight(wheels_of(slip={'acceleration': k}), 0.5, speed_mps, cruise_s=1.0)
    assert extra_m[60, 0] == pytest.approx(k * 0.5 * 0.5 * 0.5 * 0.61**2, rel=0.03)
    assert extra_m[110] == pytest.approx([0.5 * k * speed_mps**2] * 2, rel=0.03)
    np.testing.assert_allclose(extra_m[-1], 0.0, atol=1e-4)
    np.testing.assert_allclose(np.cumsum(more_mps, axis=0) * TICK_S, extra_m, atol=1e-9)  # the speeds have it, too


def test_the_simulated_robot_slips_as_the_sampled_drives_of_advice(make_simulator):
    """On a circle the wheels' yaw runs ahead by 2 k v^2 / L of the true one."""
    k, speed_mps, turn_radps = 0.02, 0.6, 0.6
    simulator = make_simulator(wheel_errors={'slip': {'lateral_acceleration': k}})
    angles_rad, turned_rad = drive(simulator, speed_mps, turn_radps, 2.0 * math.pi / turn_radps)
    error_rad = RADIUS_M * np.diff(angles_rad)[0] / SEPARATION_M - turned_rad
    assert error_rad == pytest.approx(2.0 * k * speed_mps**2 / SEPARATION_M * turned_rad, rel=0.06)  # less on ramps
    times_s, rims_mps = np.arange(0.0, 10.0, 0.1), np.array([0.48, 0.72])
    extra_m = extra_travel((0.0, k), times_s, times_s[:, None] * rims_mps, SEPARATION_M)
    np.testing.assert_allclose(extra_m[-1], 9.9 * rims_mps * [-0.36 * k, 0.36 * k])


def test_slip_by_acceleration_of_a_sampled_drive_from_rest_to_rest_adds_up_to_nothing():
    times_s = np.sort(np.random.default_rng(2).uniform(0.0, 10.0, 400))
    travels_m = np.tile(np.where(times_s < 5.0, times_s**2, 50.0 - (10.0 - times_s) ** 2)[:, None], 2)
    extra_m = extra_travel((0.01, 0.0), times_s, travels_m, SEPARATION_M)
    assert extra_m.max() == pytest.approx(0.5 * 0.01 * 10.0**2, rel=0.03)
    np.testing.assert_allclose(extra_m[-1], 0.0, atol=0.01 * extra_m.max())


@pytest.mark.parametrize('key', ['acceleration', 'spin_travel'])
def test_half_the_friction_doubles_slip(key):
    errors = {'slip': {key: 0.01}}
    extra_m, _ = rolled_straight(wheels_of(**errors), factors=(1.0, 2.0))
    single_m, _ = rolled_straight(wheels_of(**errors))
    np.testing.assert_allclose(extra_m[:100], single_m[:100] * [1.0, 2.0], rtol=0.03)


def test_an_area_changes_the_slip_of_the_wheel_on_it_and_the_world_that_of_both(make_simulator, tmp_path):
    areas = [FloorArea(mu=0.5, **LEFT_OF_AXIS)]
    errors = {'left_slip': 0.01, 'right_slip': 0.01}

    def yaw_rad(**options):
        simulator = make_simulator(wheel_errors=errors, **options)
        angles_rad, _ = drive(simulator, 0.4, 0.0, 5.0)
        return simulator.physics.base_pose_in_plane(), angles_rad

    pose, angles_rad = yaw_rad(floor=areas)
    true_m = angles_rad * RADIUS_M * [0.98, 0.99]
    assert pose.yaw_rad == pytest.approx(np.diff(true_m)[0] / SEPARATION_M, rel=0.01)
    world = box_world(tmp_path / 'slippery.world')
    friction = '</geometry><surface><friction><ode><mu>0.25</mu></ode></friction></surface>'
    world.write_text(world.read_text().replace('</geometry>', friction))
    pose, angles_rad = yaw_rad(world=world)
    np.testing.assert_allclose((pose.x_m - START.x_m) / (angles_rad * RADIUS_M), 0.96, atol=2e-4)
    world.write_text(world.read_text().replace('0.25', '-1'))
    with pytest.raises(ConfigError, match=r"slippery.world: .*/mu: given '-1'; allowed: 0.001 to"):
        make_simulator(world=world)


def test_the_last_of_overlapping_areas_counts_and_a_reversed_one_is_an_error():
    floor = Floor(2.0, [FloorArea(mu=0.5, **LEFT_OF_AXIS), FloorArea(mu=0.1, **{**LEFT_OF_AXIS, 'x_min': 0.0})])
    assert [floor.slip_factor(x_m, y_m) for x_m, y_m in ((-1, 1), (1, 1), (1, -1))] == [2.0, 10.0, 0.5]
    with pytest.raises(ConfigError, match=r'^floor: y_max: given -1.0; allowed: at least y_min, 0.0'):
        FloorArea.from_mapping({**LEFT_OF_AXIS, 'y_max': -1.0, 'mu': 1.0}, 'floor')


def test_wheels_spin_at_starts_above_the_limit_by_the_mean_travel():
    slip = {'spin_travel': 0.02, 'spin_above': 0.4}
    spins_m, speeds_mps = zip(*[rolled_straight(wheels_of(seed, slip=slip)) for seed in range(400)])
    ends_m = np.array(spins_m)[:, -1].ravel()
    assert ends_m.mean() == pytest.approx(0.02, rel=0.1) and ends_m.std() == pytest.approx(0.02, rel=0.15)
    np.testing.assert_allclose(np.sum(speeds_mps, axis=1).ravel() * TICK_S, ends_m)
    assert abs(np.diff(np.array(spins_m)[:, 20:], axis=1)).max() < 1e-9  # over after 0.2 s
    gentle_m, _ = rolled_straight(wheels_of(slip=slip), acceleration_mps2=0.39)
    slippery_m, _ = rolled_straight(wheels_of(slip=slip), acceleration_mps2=0.39, factors=(2.0, 2.0))
    assert not gentle_m.any() and slippery_m[-1].all()


def test_bumps_come_at_the_mean_distance_and_add_to_the_variance_that_odometry_assumes():
    errors = {'slip': {'bump_travel': 1e-3, 'bump_distance': 0.2}}
    runs_m = np.array([rolled_straight(wheels_of(seed, **errors), cruise_s=1.0)[0] for seed in range(400)])
    bumps = (abs(np.diff(runs_m, axis=1)) > 1e-9).sum(axis=1).ravel()
    assert bumps.mean() == pytest.approx(1.0 / 0.2, rel=0.05) and bumps.var() == pytest.approx(5.0, rel=0.2)
    variance = WheelErrorParams.from_mapping(errors, '').travel_variance
    assert variance == pytest.approx(5e-6) and runs_m[:, -1].var() == pytest.approx(variance, rel=0.2)


def test_equal_seeds_repeat_spins_and_bumps_and_so_does_a_reset(make_simulator):
    slip = {'spin_travel': 0.01, 'bump_travel': 1e-3, 'bump_distance': 0.05, 'acceleration': 0.01}
    simulator = make_simulator(seed=5, wheel_errors={'slip': slip})

    def angles(simulator):
        return drive(simulator, 0.4, 0.2, 1.0)[0].tolist()

    first = angles(simulator)
    simulator.reset()
    again = angles(simulator)
    assert first == again == angles(make_simulator(seed=5, wheel_errors={'slip': slip}))
    assert first != angles(make_simulator(seed=6, wheel_errors={'slip': slip}))
    # Bumps and spin leave the noise of slip as it is.
    noisy = {'slip_noise': 1e-5}
    bumpy = angles(make_simulator(seed=5, wheel_errors={**noisy, 'slip': {'bump_travel': 1e-9}}))
    np.testing.assert_allclose(bumpy, angles(make_simulator(seed=5, wheel_errors=noisy)), atol=1e-6)


def test_slip_noise_has_the_variance_that_was_asked_for(make_simulator):
    noise, errors_m = 1e-4, []
    for seed in range(40):
        simulator = make_simulator(seed=seed, wheel_errors={'slip_noise': noise})
        wheels, _ = drive(simulator, 0.45, 0.0, 2.0)
        errors_m += (RADIUS_M * wheels - (simulator.physics.base_pose_in_plane().x_m + 10)).tolist()
        simulator.close()
    path_m = 0.9 - 0.45 * 0.3  # the ramp takes 0.6 s, on average at half the speed
    # 80 samples: their variance is within 1 +- 0.45 of the true one in 99 % of cases.
    assert np.var(errors_m) == pytest.approx(noise * path_m, rel=0.45)


def test_robots_differ_from_each_other_by_the_spread_that_was_asked_for():
    params = WheelErrorParams(left_radius_error=0.01, radius_spread=0.002, wheel_separation_spread=0.004)
    drawn = np.array([params.geometry(np.random.default_rng(seed)) for seed in range(2000)])
    np.testing.assert_allclose(drawn.mean(axis=0), [0.01, 0.0, 0.0], atol=3e-4)
    np.testing.assert_allclose(drawn.std(axis=0), [0.00202, 0.002, 0.004], rtol=0.06)
