"""Calibration of generated robots: intervals contain the truth, disturbances are found, bad drives are refused."""

import math

import numpy as np
import pytest

from calibration_drives import WHEEL_HZ, TrueRobot, random_robot, referenced_drive
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.calibration.estimation import calibrate, track_of
from diff_encoder_sim.calibration.prediction import cross_predictions, predict
from diff_encoder_sim.calibration.umbmark import WheelGeometry

ROBOT = TrueRobot()
NOMINAL = WheelGeometry(0.2, 0.2, 0.4)
BY_MOTION_NAMES = ('slip_by_acceleration', 'slip_by_lateral_acceleration')


def drive_of(robot=ROBOT, seed=1, duration_s=90.0, **options):
    return referenced_drive(robot, np.random.default_rng(seed), duration_s, **options)


def misses(calibration, robot=ROBOT):
    """How far each value is from the truth, in halves of its interval."""
    found = {}
    for name, (value, (low, high)) in calibration.values.items():
        if name in robot._fields:
            found[name] = (value - getattr(robot, name)) / (0.5 * (high - low))
    return found


@pytest.fixture(scope='module')
def calibration():
    return calibrate([drive_of()], NOMINAL)


def test_the_intervals_of_a_robot_contain_its_geometry_sensor_and_slip(calibration):
    assert max(map(abs, misses(calibration).values())) < 1.8
    values = calibration.values
    assert values['radius_ratio'].value == pytest.approx(1.006, abs=5e-4)
    assert values['radius_per_separation'].value == pytest.approx(0.1 / 0.41, rel=1e-3)
    assert values['reference_delay_s'].interval[1] - values['reference_delay_s'].interval[0] < 0.02
    assert not calibration.undetermined
    assert not calibration.disturbances


def test_the_covariance_of_the_geometry_knows_the_ratio_better_than_the_scale(calibration):
    covariance = calibration.geometry_covariance
    of_ratio, of_scale = np.array([-1.0, 1.0, 0.0]), np.array([0.5, 0.5, 0.0])
    low, high = calibration.values['radius_ratio'].interval
    halves = 0.5 * math.log(high / low) / math.sqrt(of_ratio @ covariance @ of_ratio)
    assert 1.96 <= halves < 2.6  # Student's t
    assert of_ratio @ covariance @ of_ratio < 4.0 * (of_scale @ covariance @ of_scale)


@pytest.mark.parametrize(('true', 'unsupported'), [((0.02, 0.02), []), ((0.0, 0.0), list(BY_MOTION_NAMES))])
def test_slip_by_motion_is_found_and_only_supported_if_there_is_some(true, unsupported):
    robot = ROBOT._replace(**dict(zip(BY_MOTION_NAMES, true)), noise_m=0.002, noise_rad=0.002)
    found = calibrate([drive_of(robot, seed=4, duration_s=240.0)], NOMINAL, has_slip_by_motion=True)
    assert found.unsupported == unsupported and set(found.support) == {*BY_MOTION_NAMES}
    assert max(map(abs, misses(found, robot).values())) < 1.8
    low, high = found.values['slip_by_lateral_acceleration'].interval
    assert high - low < 0.01
    (prediction,) = cross_predictions([drive_of(robot, seed=5)], NOMINAL, found.parameters)
    assert prediction.is_inside.all()


def test_slip_by_motion_is_not_estimated_unless_wanted(calibration):
    assert not calibration.support and not {*BY_MOTION_NAMES} & {*calibration.values}


def test_positions_alone_are_sufficient():
    robot = ROBOT._replace(noise_m=0.003)
    calibration = calibrate([drive_of(robot, has_yaw=False)])
    assert 'reference_yaw_rad' not in calibration.values
    assert max(map(abs, misses(calibration, robot).values())) < 2.0


def test_the_scale_of_the_reference_widens_lengths_but_not_their_ratios(calibration):
    drive = drive_of()
    scaled = calibrate([drive._replace(reference=drive.reference._replace(scale_std=0.02))])
    narrow, wide = (
        {name: np.ptp(each.interval) for name, each in found.values.items()} for found in (calibration, scaled)
    )
    assert wide['left_wheel_diameter_m'] > 0.07 * 0.2
    assert wide['radius_ratio'] == pytest.approx(narrow['radius_ratio'])
    assert wide['radius_per_separation'] == pytest.approx(narrow['radius_per_separation'])


def test_several_drives_narrow_the_intervals(calibration):
    both = calibrate([drive_of(), drive_of(seed=2)], NOMINAL)

    def width(found):
        low, high = found.values['wheel_separation_m'].interval
        return high - low

    assert width(both) < 0.9 * width(calibration)


@pytest.mark.parametrize(
    ('change', 'says'),
    [
        (lambda angles: angles[:, ::-1], 'swapped'),
        (lambda angles: -angles, 'both reversed'),
        (lambda angles: angles * [-1.0, 1.0], '--reversed left'),
        (lambda angles: angles * [1.0, -1.0], '--reversed right'),
        (lambda angles: 0.0 * angles, 'turns by 0.00 rad'),
        (
            lambda angles: angles + np.array([0.0, 500.0]) * (np.arange(len(angles))[:, np.newaxis] > 900),
            '--ticks-modulus',
        ),
    ],
)
@pytest.mark.parametrize('has_yaw', [True, False])
def test_wheels_that_cannot_be_right_are_an_error(change, says, has_yaw):
    drive = drive_of(duration_s=60.0, has_yaw=has_yaw)
    changed = Drive(drive.drive.stamps_ns, change(drive.drive.wheel_angles_rad))
    with pytest.raises(ConfigError, match=f'^drive: .*{says}'):
        calibrate([drive._replace(drive=changed)])


def test_a_reference_of_another_robot_and_a_short_one_are_errors():
    drive, other = drive_of(duration_s=60.0), drive_of(seed=3, duration_s=60.0)
    with pytest.raises(ConfigError, match='off the path of the wheels'):
        calibrate([drive._replace(reference=other.reference)])
    with pytest.raises(ConfigError, match='at least 10 s'):
        calibrate([drive_of(duration_s=9.0)])
    with pytest.raises(ConfigError, match='diameter of 20.* m; allowed: 0.005 to 2 m; see --length-unit'):
        calibrate(
            [drive._replace(reference=drive.reference._replace(poses=drive.reference.poses * [100.0, 100.0, 1.0]))]
        )
    still = drive.reference._replace(poses=0.0001 * drive.reference.poses)
    with pytest.raises(ConfigError, match='the reference moves by'):
        calibrate([drive._replace(reference=still)])


@pytest.mark.parametrize('kind', ['pushed', 'lifted', 'reference jumps', 'yaw jumps', 'outliers', 'missing'])
def test_disturbances_are_reported_with_their_times_and_change_little(kind):
    drive = drive_of()
    angles_rad, reference = drive.drive.wheel_angles_rad.copy(), drive.reference
    times_s, poses = drive.drive.stamps_ns / 1e9, reference.poses.copy()
    after, kept = reference.stamps_ns > 40e9, np.ones(len(angles_rad), bool)
    if kind == 'pushed':
        turn = np.array([[math.cos(0.4), math.sin(0.4)], [-math.sin(0.4), math.cos(0.4)]])
        place = poses[after][0, :2].copy()
        poses[after, :2] = place + [0.3, 0.1] + (poses[after, :2] - place) @ turn
        poses[after, 2] += 0.4
    elif kind == 'lifted':
        angles_rad[:, 0] += 8.0 * np.clip(times_s - 40.0, 0.0, 1.0)
    elif kind == 'reference jumps':
        poses[after, :2] += [0.5, -0.3]
    elif kind == 'yaw jumps':
        poses[(reference.stamps_ns > 40e9) & (reference.stamps_ns < 46e9), 2] += 1.0
    elif kind == 'outliers':
        poses[after.argmax() + np.array([0, 1, 200])] = 0.0
    else:
        kept = (times_s < 40.0) | (times_s > 44.0)
    changed = drive._replace(
        drive=Drive(drive.drive.stamps_ns[kept], angles_rad[kept]), reference=reference._replace(poses=poses)
    )
    calibration = calibrate([changed])
    assert max(map(abs, misses(calibration).values())) < 2.5
    assert any(each.start_s - 1.0 <= 40.0 <= each.end_s + 1.0 for each in calibration.disturbances)
    assert sum(each.end_s - each.start_s for each in calibration.disturbances) < 12.0
    assert any(each.is_lasting for each in calibration.disturbances) == (kind != 'outliers')


def test_a_yaw_that_jumps_for_good_is_used_on_one_side():
    drive = drive_of()
    poses, after = drive.reference.poses.copy(), drive.reference.stamps_ns > 60e9
    poses[after, 2] += 1.0
    calibration = calibrate([drive._replace(reference=drive.reference._replace(poses=poses))])
    off_rad = calibration.values['reference_yaw_rad'].value - ROBOT.reference_yaw_rad
    assert min(abs(off_rad), abs(off_rad - 1.0)) < 0.01
    assert any(abs(each.start_s - 60.0) < 3.0 or abs(each.end_s - 60.0) < 3.0 for each in calibration.disturbances)


def test_a_straight_line_does_not_determine_the_separation():
    forward_mps = np.full(int(40.0 * WHEEL_HZ), 0.5)
    drive = drive_of(speeds=(forward_mps, 0.0 * forward_mps))
    calibration = calibrate([drive], NOMINAL)
    assert 'wheel_separation_m' in calibration.undetermined
    assert calibration.values['radius_ratio'].value == pytest.approx(1.006, abs=2e-3)
    assert 'left_wheel_diameter_m' not in calibration.undetermined
    assert calibration.geometry_covariance[2, 2] == pytest.approx(0.01**2)  # nominal


@pytest.mark.parametrize('seed', range(5))
def test_positions_show_neither_swapped_wheels_on_a_line_nor_the_direction_of_the_sensor_in_turns(seed):
    robot, times_s = ROBOT._replace(slip_m2_per_m=1e-7), np.arange(0.0, 40.0, 1.0 / WHEEL_HZ)
    straight = calibrate([drive_of(robot, seed, speeds=(0.4 + 0.0 * times_s, 0.0 * times_s), has_yaw=False)], NOMINAL)
    assert {'wheel_separation_m', 'reference_x_m'} < {*straight.undetermined}
    turning_radps = 0.6 * np.sign(np.sin(0.25 * times_s + 0.3))
    turns = calibrate([drive_of(robot, seed, speeds=(0.0 * times_s, turning_radps), has_yaw=False)], NOMINAL)
    assert {'reference_x_m', 'reference_y_m', 'radius_ratio'} < {*turns.undetermined}
    assert abs(misses(turns, robot)['wheel_separation_m']) < 1.5
    assert turns.values['radius_per_separation'].value == pytest.approx(0.1 / 0.41, rel=0.015)


@pytest.mark.parametrize('seed', [20049, 20057, 20104, 20109])
def test_a_first_guess_by_positions_does_not_leave_out_the_turns(seed):
    rng = np.random.default_rng(seed)
    robot = random_robot(rng)
    calibration = calibrate([referenced_drive(robot, rng, 60.0, has_yaw=False)])
    ratio = 0.5 * robot.left_wheel_diameter_m / robot.wheel_separation_m
    assert calibration.values['radius_per_separation'].value == pytest.approx(ratio, rel=0.02)


def test_a_second_without_wheels_is_no_disturbance():
    drive = drive_of(has_yaw=False)
    kept = abs(drive.drive.stamps_ns / 1e9 - 40.0) > 0.75
    changed = Drive(drive.drive.stamps_ns[kept], drive.drive.wheel_angles_rad[kept])
    calibration = calibrate([drive._replace(drive=changed)])
    assert not calibration.disturbances
    assert max(map(abs, misses(calibration).values())) < 2.0


def test_a_drive_is_predicted_from_others_and_its_half_from_the_other_half():
    drives = [drive_of(seed=seed, name=f'drive {seed}') for seed in range(3)]
    predictions = cross_predictions(drives, NOMINAL, calibrate(drives, NOMINAL).parameters)
    assert [each.drive for each in predictions] == ['drive 0', 'drive 1', 'drive 2']
    z = np.array([each.error / each.std for each in predictions])
    assert abs(z).max() < 3.5
    assert all(abs(each.nominal_error[1]) > 3.0 * each.std[1] for each in predictions)
    (half,) = cross_predictions(drives[:1], None, calibrate(drives[:1]).parameters)
    assert half.drive == 'drive 0, second half'
    assert half.nominal_error is None


def test_predictions_of_random_robots_are_honest():
    z = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        robot = random_robot(rng)
        calibration = calibrate([referenced_drive(robot, rng, 90.0)])
        prediction = predict(calibration, referenced_drive(robot, rng, 60.0))
        z += (prediction.error / prediction.std).tolist()
    assert 0.5 < np.std(z) < 1.6


def test_an_exact_drive_that_is_nearly_straight_has_neither_disturbances_nor_slip():
    exact = ROBOT._replace(noise_m=1e-9, noise_rad=1e-9, slip_m2_per_m=0.0, slip_rad2_per_rad=0.0, counts=10**7)
    times_s = np.arange(0.0, 45.0, 1.0 / WHEEL_HZ)
    forward_mps = np.interp(times_s, [0.0, 1.0, 40.0, 43.0], [0.0, 0.45, 0.45, 0.0])
    turning_radps = 0.02 * np.sin(0.5 * times_s) * (times_s > 15.0)
    nominal = WheelGeometry(0.2, 0.2, exact.wheel_separation_m)
    calibration = calibrate([drive_of(exact, speeds=(forward_mps, turning_radps))], nominal)
    assert not calibration.disturbances
    assert calibration.values['left_wheel_diameter_m'].value == pytest.approx(exact.left_wheel_diameter_m, rel=1e-3)
    assert math.sqrt(calibration.values['slip_rad2_per_rad'].value) < math.radians(0.1)  # after a radian


def test_a_part_of_a_drive_does_not_depend_on_turns_before_it():
    whole = track_of(drive_of())
    part = whole.between(20, 40)
    of_whole, of_part = (track.motions(ROBOT.parameters, part.pose_times_s) for track in (whole, part))
    assert np.diff(of_part[:, 2:], axis=0) == pytest.approx(np.diff(of_whole[:, 2:], axis=0), abs=1e-9)
    assert of_part[0, 5] < 0.5 * of_whole[0, 5]  # turned: a wrong separation must not turn its start


def test_turns_in_place_by_an_exact_reference_at_the_centre_determine_radius_per_separation():
    exact = ROBOT._replace(reference_x_m=0.0, reference_y_m=0.0, noise_m=1e-9, noise_rad=1e-9, counts=10**7)
    turning_radps = np.interp(np.arange(0.0, 40.0, 1.0 / WHEEL_HZ), [0.0, 1.0, 36.0, 37.0], [0.0, 1.0, 1.0, 0.0])
    calibration = calibrate([drive_of(exact, speeds=(0.0 * turning_radps, turning_radps))], NOMINAL)
    left_m, right_m, separation_m = np.exp(calibration.parameters[:3])
    expected = (exact.left_wheel_diameter_m + exact.right_wheel_diameter_m) / exact.wheel_separation_m
    assert (left_m + right_m) / separation_m == pytest.approx(expected, rel=2e-3)
    assert calibration.values['reference_delay_s'].value == pytest.approx(exact.reference_delay_s, abs=0.02)
