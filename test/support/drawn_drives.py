"""Robots and drives to draw odometry of, and the same drives one by one."""

import math

import numpy as np

from diff_encoder_sim.advice.drive_draws import DrawnRobot, ErrorFreeDrive
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import Pose2D, poses_of_wheels, wrap_angle
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.calibration_file import CalibrationParams
from diff_encoder_sim.robots.simulated_robot import TrueWheels
from diff_encoder_sim.simulation.self_check import RolledDrive
from diff_encoder_sim.simulation.slip import SlippingWheels, WheelErrorParams
from diff_encoder_sim.simulation.state import TICK_NS, TICK_S
from diff_encoder_sim.trials.scripted_drive import SETTLING_S, ScriptedDrive
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from encoder_drives import RADIUS_M, SEPARATION_M

EXACT_STOP = StopSpread(0.0, 0.0)
LINE_M = 20.0


def robot_of(radius_m=RADIUS_M, separation_m=SEPARATION_M, stop=EXACT_STOP, calibration=None, **errors):
    """A robot whose drawing is right; its true wheels have the errors."""
    odometry = OdometryParams(wheel_diameter=2.0 * radius_m, wheel_separation=separation_m, motion_noise=0.0)
    wheels = TrueWheels(radius_m, radius_m, separation_m)
    return DrawnRobot(wheels, WheelErrorParams(**errors), odometry, odometry.axle_x, stop, calibration)


def calibrated(scale=0.0, ratio=0.0, turning=0.0, slip_m2_per_m=0.0, slip_rad2_per_rad=0.0):
    """A calibration of ALTO by the standard deviations of what it determines, which are independent."""
    causes = np.array([[1.0, -0.5, 0.0], [1.0, 0.5, 0.0], [1.0, 0.0, -1.0]]) * [scale, ratio, turning]
    values = {
        **dict.fromkeys(('left_wheel_diameter_m', 'right_wheel_diameter_m'), 2.0 * RADIUS_M),
        **dict.fromkeys(('reference_x_m', 'reference_y_m', 'reference_delay_s'), 0.0),
        'wheel_separation_m': SEPARATION_M,
        'slip_m2_per_m': slip_m2_per_m,
        'slip_rad2_per_rad': slip_rad2_per_rad,
    }
    estimates = {name: {'value': value, 'interval': [value, value]} for name, value in values.items()}
    drives = [{'file': 'drive.bag', 'sha256': 64 * '0'}]
    covariance = (causes @ causes.T).tolist()
    return CalibrationParams.from_mapping({**estimates, 'geometry_covariance': covariance, 'drives': drives}, '')


def rolled(*segments, separation_m=SEPARATION_M, start=(), name='rolled', **limits):
    """A drive of `('straight', metres)` and `('turns', number)` on wheels that roll without a simulator."""
    about = {'name': name, 'world': 'hallway', 'start': dict(start), 'limits': limits}
    test = TestDefinition.from_mapping({**about, 'drive': [dict([segment]) for segment in segments]}, '')
    script = ScriptedDrive(test)
    times_s = TICK_S * np.arange(math.ceil((script.duration_s + SETTLING_S) / TICK_S) + 1)
    speeds = np.array([script.command_at(time_s, TICK_S) for time_s in times_s[:-1].tolist()])
    half_difference_mps = 0.5 * separation_m * speeds[:, 1]
    speeds_mps = np.column_stack([speeds[:, 0] - half_difference_mps, speeds[:, 0] + half_difference_mps])
    ways_m = np.concatenate([np.zeros((1, 2)), np.cumsum(TICK_S * speeds_mps, axis=0)])
    end = test.drive_end().relative_to(test.start.pose())
    return ErrorFreeDrive(Trial(test=test, nav='scripted'), RolledDrive(times_s, ways_m, separation_m, end))


def line(length_m=LINE_M, **limits):
    """A straight drive."""
    return rolled(('straight', length_m), **limits)


def encoder_of(ppr, encoder=None, **params):
    return EncoderParams.from_mapping({'ppr': ppr, 'encoder': encoder or {}, **params}, '')


def one_by_one(drive, robot, encoder, seed):
    """(3,) the final error of one draw: x [m], y [m], yaw [rad] in the map."""
    rng = np.random.default_rng(seed)
    ways_m = _to_an_end(drive.rolled, robot.stop, rng)
    factors = 1.0 + np.array(robot.errors.geometry(rng))
    wheels = TrueWheels(*(np.array(robot.sound) * factors).tolist())
    swing_m = 0.5 * (ways_m[:, 1] - ways_m[:, 0]) * (wheels.separation_m / drive.rolled.separation_m)
    ahead_m = ways_m.mean(axis=1)
    rolled_rad = np.column_stack([ahead_m - swing_m, ahead_m + swing_m]) / wheels[:2]
    told = _told(robot, encoder.model_copy(update={'seed': seed}), wheels, rolled_rad, drive.rolled.times_s, rng)
    end, sound_end = (_integrated(each, drive.rolled.separation_m) for each in (ways_m, drive.rolled.ways_m))
    # A simulated drive's contacts slip a little: its wheels' way ends beside the true one.
    true_end, axle = drive.rolled.end.compose(end.relative_to(sound_end)), Pose2D(robot.axle_x_m, 0.0, 0.0)
    start = drive.requested.test.start.pose()
    true_base, told_base = start.compose(axle).compose(true_end).compose(axle.inverse()), start.compose(told)
    turned_rad = wrap_angle(told_base.yaw_rad - true_base.yaw_rad)
    return np.array([told_base.x_m - true_base.x_m, told_base.y_m - true_base.y_m, turned_rad])


def _to_an_end(drive: RolledDrive, stop: StopSpread, rng) -> np.ndarray:
    """The ways of a drive that ends a little farther or nearer, and turned a little more or less."""
    travelled_m = np.cumsum(np.abs(np.diff(drive.ways_m, axis=0, prepend=0.0)).sum(axis=1, keepdims=True), axis=0)
    done = travelled_m / travelled_m[-1]
    ahead_m, turn_rad = rng.uniform(-1.0, 1.0, 2) * stop
    half_m = 0.5 * drive.separation_m * turn_rad
    return drive.ways_m + done * [ahead_m - half_m, ahead_m + half_m]


def _told(robot, params, wheels, rolled_rad, times_s, rng) -> Pose2D:
    known = {'ppr': params.ppr, 'encoder': params.encoder, 'motion_noise': 0.0}
    slipping = SlippingWheels(robot.errors, wheels, rng, rng)
    phases_rad = rng.uniform(0.0, 2.0 * math.pi, (1, 2))
    turned_rad = np.array([slipping.turned(tuple(angles_rad)) for angles_rad in rolled_rad.tolist()])
    chain = Chain(params, robot.odometry.model_copy(update=known))
    return Pose2D(*chain.run(Drive(TICK_NS * np.arange(len(times_s)), turned_rad), phases_rad).final_poses[0].tolist())


def _integrated(ways_m: np.ndarray, separation_m: float) -> Pose2D:
    return Pose2D(*poses_of_wheels(ways_m[np.newaxis, ::5], 1.0, 1.0, separation_m, 0.0, True)[0, 0].tolist())
