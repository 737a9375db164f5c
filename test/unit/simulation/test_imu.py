"""The errors of an IMU by their closed forms, and the motion that it measures."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.simulation.imu import Imu
from diff_encoder_sim.simulation.physics import GRAVITY_MPS2

AT_REST = (0.0, 0.0, 0.0, 1.0, *[0.0] * 6)  # orientation, velocity, angular velocity
UP = [0.0, 0.0, GRAVITY_MPS2]
MS = 1_000_000


def imu_of(seed=1, **params):
    return Imu(ImuParams.from_mapping(params, 'test'), GRAVITY_MPS2, np.random.default_rng(seed))


def turning(*radps):
    return (*AT_REST[:7], *radps)


def allan_variance(samples, averaged):
    """The overlapping Allan variance (n, axes) of averages over this number of samples."""
    total = np.cumsum(np.concatenate([np.zeros_like(samples[:1]), samples]), axis=0)
    second = total[2 * averaged :] - 2 * total[averaged:-averaged] + total[: -2 * averaged]
    return (second**2).mean(axis=0) / (2 * averaged**2)


def expected_allan_variance(noise_density, drift, bias_time, tau_s):
    x = tau_s / bias_time
    return noise_density**2 / tau_s + 2 * drift**2 / x * (1 - (3 - 4 * math.exp(-x) + math.exp(-2 * x)) / (2 * x))


@pytest.mark.parametrize('tau_s', [0.1, 5.0, 200.0])
def test_the_allan_deviation_is_that_of_white_noise_and_drift(tau_s):
    """Of 24 axes: if only noise matters, between, and beyond the greatest deviation of the drift."""
    sensor = {'noise_density': 1e-4, 'bias_instability': 3e-4, 'bias_time': 20.0, 'bias': 0.1}
    motions = np.tile(AT_REST, (400_000, 1))
    variances = []
    for seed in range(4):
        imu = imu_of(seed, gyroscope=sensor, accelerometer=sensor)
        variances += allan_variance(imu.measure(motions), round(tau_s * 100)).tolist()
    drift = ImuParams.from_mapping({'gyroscope': sensor}, '').gyroscope.bias_drift
    expected = expected_allan_variance(1e-4, drift, 20.0, tau_s)
    # Independent averages: the total time over tau, two of which make a difference.
    deviations = math.sqrt(2 / (24 * 4000 / tau_s / 2))
    assert np.mean(variances) == pytest.approx(expected, rel=4 * deviations)


def test_steps_and_batches_have_the_same_outputs_bit_for_bit():
    sensor = {'noise_density': 0.01, 'bias_instability': 1e-3, 'bias': 0.1, 'scale_error': 0.01, 'misalignment': 0.01}
    motions = np.random.default_rng(5).normal(size=(700, 10))
    motions[:, :4] /= np.linalg.norm(motions[:, :4], axis=1)[:, None]
    whole, steps, blocks = (imu_of(gyroscope=sensor, accelerometer=sensor) for _ in range(3))
    expected = whole.measure(motions)
    assert (np.concatenate([steps.measure(motions[k : k + 1]) for k in range(700)]) == expected).all()
    assert (np.concatenate([blocks.measure(part) for part in np.split(motions, [1, 300, 310])]) == expected).all()
    assert (imu_of(2, gyroscope=sensor, accelerometer=sensor).measure(motions) != expected).all()


def test_scale_and_misalignment_are_constant_with_their_standard_deviations():
    scales, crosses = [], []
    for seed in range(300):
        imu = imu_of(seed, gyroscope={'scale_error': 0.02, 'misalignment': 0.005})
        first = imu.measure(np.array([turning(2.0, 0.0, 0.0), turning(0.0, 2.0, 0.0), turning(0.0, 0.0, 2.0)]))
        again = imu.measure(np.array([turning(-4.0, 0.0, 0.0)]))
        assert again[0, :3] == pytest.approx(-2 * first[0, :3])
        assert first[:, 3:] == pytest.approx(np.tile(UP, (3, 1)))
        scales += (np.diag(first[:, :3]) / 2 - 1).tolist()
        crosses += (first[:, :3][~np.eye(3, dtype=bool)] / 2).tolist()
    assert np.std(scales) == pytest.approx(0.02, rel=0.1) and np.std(crosses) == pytest.approx(0.005, rel=0.1)


def test_the_offset_is_constant_from_start_to_end_and_differs_from_start_to_start():
    outputs = np.stack([imu_of(seed, gyroscope={'bias': 0.1}).measure(np.tile(AT_REST, (5, 1))) for seed in range(200)])
    assert np.ptp(outputs, axis=1).max() == 0.0
    assert np.std(outputs[:, 0, :3]) == pytest.approx(0.1, rel=0.1)


def test_outputs_are_whole_steps_within_the_range():
    imu = imu_of(gyroscope={'resolution': 0.25, 'range': 3.0}, accelerometer={'resolution': 0.5})
    outputs = imu.measure(np.array([turning(0.3, -0.7, 1.1), turning(9.0, -9.0, 2.9)]))
    assert outputs[:, :3].tolist() == [[0.25, -0.75, 1.0], [3.0, -3.0, 3.0]]
    assert outputs[0, 3:].tolist() == [0.0, 0.0, 10.0]


def test_an_ideal_imu_on_a_circle_measures_turn_rate_gravity_and_centripetal_acceleration():
    yaws_rad, turn = (0.5 * 0.01 * np.arange(300)).tolist(), (0.0, 0.0, 0.5)
    motions = [(*quat_xyzw_from_yaw(yaw), math.cos(yaw), math.sin(yaw), 0.0, *turn) for yaw in yaws_rad]
    outputs = imu_of().measure(np.array(motions))
    assert outputs[0] == pytest.approx([0.0, 0.0, 0.5, 100.0, 0.25, GRAVITY_MPS2])  # it starts from rest
    assert outputs[1:] == pytest.approx(np.tile([0.0, 0.0, 0.5, 0.0, 0.5, GRAVITY_MPS2], (299, 1)), abs=1e-9)


def test_a_leaning_imu_at_rest_measures_gravity_along_its_axes():
    lean = (math.sin(0.1), 0.0, 0.0, math.cos(0.1), *[0.0] * 6)  # roll of 0.2 rad
    expected = [0.0, GRAVITY_MPS2 * math.sin(0.2), GRAVITY_MPS2 * math.cos(0.2)]
    assert imu_of().measure(np.array([lean]))[0, 3:] == pytest.approx(expected)


def test_a_mounted_imu_measures_along_its_axes_and_at_its_place():
    """Turned by 90 degrees to the left, 0.2 m ahead of the axis about which the body turns."""
    pose = (0.2, 0.0, 0.0), quat_xyzw_from_yaw(0.5 * math.pi)
    imu = Imu(ImuParams(), GRAVITY_MPS2, np.random.default_rng(1), pose)
    yaws_rad = (2.0 * 0.01 * np.arange(100)).tolist()
    motions = [(*quat_xyzw_from_yaw(yaw), 0.0, 0.0, 0.0, 0.0, 0.0, 2.0) for yaw in yaws_rad]
    centripetal_mps2 = 2.0**2 * 0.2  # backward, which is along its y axis
    assert imu.measure(np.array(motions))[1:] == pytest.approx(
        np.tile([0.0, 0.0, 2.0, 0.0, centripetal_mps2, GRAVITY_MPS2], (99, 1)), abs=1e-9
    )


# ---- in the simulator


def samples_of(simulator, seconds):
    """(time of the message, sample) of each."""
    found = []
    for _ in range(round(100 * seconds)):
        found.append((simulator.time_ns, simulator.imu()))
        simulator.tick()
    return [(now_ns, sample) for now_ns, sample in found if sample is not None]


def test_the_gyroscope_integrates_to_the_yaw_and_the_accelerometer_to_the_speed(make_simulator):
    simulator = make_simulator(imu={}, start=Pose2D(-10, 0, 0.3))
    samples = samples_of(simulator, 0.5)
    simulator.command(0.5, 0.4)
    samples += samples_of(simulator, 0.45)
    stopping = simulator.physics.base_pose_in_plane().yaw_rad, math.hypot(*simulator.physics.base().linear_xyz_mps)
    samples.append((0, simulator.imu()))
    rates, forces = (np.array([sample[part] for _, sample in samples]) for part in (1, 2))
    assert 0.3 + 0.01 * rates[:, 2].sum() == pytest.approx(stopping[0], abs=1e-4)
    assert 0.01 * forces[:, 0].sum() == pytest.approx(stopping[1], abs=2e-3)
    assert forces[:40].mean(axis=0) == pytest.approx(UP, abs=1e-2)


def test_messages_come_after_the_latency_at_the_next_tick(make_simulator):
    found = {
        latency_s: samples_of(make_simulator(imu={'rate': 50.0, 'latency': latency_s}), 0.1)
        for latency_s in (0.0, 0.0049, 0.05)
    }
    stamps_ms = {key: [sample.stamp_ns // MS for _, sample in samples] for key, samples in found.items()}
    assert stamps_ms == {0.0: [0, 20, 40, 60, 80], 0.0049: [0, 20, 40, 60, 80], 0.05: [0, 20, 40]}
    delays_ms = {key: {(now_ns - each.stamp_ns) // MS for now_ns, each in samples} for key, samples in found.items()}
    assert delays_ms == {0.0: {0}, 0.0049: {10}, 0.05: {50}}


def test_an_imu_repeats_by_its_seed_and_after_a_reset_and_changes_nothing_else(make_simulator):
    imu = {'gyroscope': {'noise_density': 1e-3}}

    def state(simulator):
        simulator.command(0.4, 0.2)
        return samples_of(simulator, 0.5), simulator.joint_states(), simulator.physics.base(), simulator.scan()

    simulator = make_simulator(seed=5, imu=imu)
    first = state(simulator)
    simulator.reset()
    for again in (state(simulator), state(make_simulator(seed=5, imu=imu))):
        assert again[:3] == first[:3] and (again[3].ranges_m == first[3].ranges_m).all()
    without = state(make_simulator(seed=5))
    assert without[0] == [] and without[1:3] == first[1:3] and (without[3].ranges_m == first[3].ranges_m).all()
    assert state(make_simulator(seed=6, imu=imu))[0] != first[0]


def test_the_frame_is_at_base_link_unless_the_robot_has_a_link_of_its_name(make_simulator):
    assert make_simulator(imu={}).imu_frames == ('base_link', 'imu_link')
    assert make_simulator().imu_frames is None
    assert make_simulator(imu={'frame': 'laser'}).imu_frames is None
