"""Random robots, and their drives with a reference: unequal wheels, a sensor off the axle, delay, slip, counts."""

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.calibration.estimation import ReferencedDrive
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.simulation.slip import extra_travel

WHEEL_HZ = 50.0
BORDER_S = 1.0  # without reference, at both ends


class TrueRobot(NamedTuple):
    """A robot, its reference and its slip."""

    left_wheel_diameter_m: float = 0.2
    right_wheel_diameter_m: float = 0.2012
    wheel_separation_m: float = 0.41
    reference_x_m: float = 0.15
    reference_y_m: float = -0.05
    reference_yaw_rad: float = 0.1
    reference_delay_s: float = 0.12
    slip_m2_per_m: float = 1e-6
    slip_rad2_per_rad: float = 1e-5
    noise_m: float = 0.005
    noise_rad: float = 0.005
    counts: int = 4096
    reference_hz: float = 10.0
    slip_by_acceleration: float = 0.0
    slip_by_lateral_acceleration: float = 0.0

    @property
    def parameters(self):
        """(9,) of likelihood.NAMES."""
        is_log = np.array([True] * 3 + [False] * 4 + [True] * 2)
        return np.where(is_log, np.log(np.where(is_log, self[:9], 1.0)), self[:9])


def random_robot(rng):
    """A robot of 6 to 50 cm wheels, with errors as robots have them."""
    diameter_m, difference = math.exp(rng.uniform(math.log(0.06), math.log(0.5))), rng.normal(0.0, 0.005)
    return TrueRobot(
        diameter_m * (1.0 - 0.5 * difference),
        diameter_m * (1.0 + 0.5 * difference),
        diameter_m * rng.uniform(1.3, 3.5),
        *(rng.uniform(-0.3, 0.3), rng.uniform(-0.2, 0.2), rng.choice([0.05, 3.0]) * rng.uniform(-1.0, 1.0)),
        rng.uniform(-0.05, 0.2),
        *(10.0 ** rng.uniform(-6.5, -4.5), 10.0 ** rng.uniform(-6.0, -4.0)),
        *(10.0 ** rng.uniform(-2.7, -1.7), 10.0 ** rng.uniform(-2.7, -1.7)),
        *(int(10.0 ** rng.uniform(2.7, 4.5)), rng.choice([5.0, 10.0, 20.0])),
    )


def random_speeds(rng, duration_s):
    """Straights, turns in place, arcs and stops of 2 to 8 s, smoothed over half a second: (n,) [m/s], (n,) [rad/s]."""
    samples = int(duration_s * WHEEL_HZ)
    forward_mps, turning_radps = np.zeros(samples), np.zeros(samples)
    fastest_mps, at = rng.uniform(0.3, 0.7), 0
    while at < samples:
        kind, steps = rng.choice(['straight', 'turn', 'arc', 'stop'], p=[0.4, 0.25, 0.3, 0.05]), rng.uniform(2.0, 8.0)
        span = slice(at, at + int(steps * WHEEL_HZ))
        if kind == 'straight':
            forward_mps[span] = fastest_mps
        elif kind == 'turn':
            turning_radps[span] = rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.0)
        elif kind == 'arc':
            forward_mps[span], turning_radps[span] = fastest_mps * rng.uniform(0.4, 1.0), rng.uniform(-0.6, 0.6)
        at = span.stop
    smooth = np.full(int(WHEEL_HZ / 2.0), 2.0 / WHEEL_HZ)
    return np.convolve(forward_mps, smooth, 'same'), np.convolve(turning_radps, smooth, 'same')


def referenced_drive(robot, rng, duration_s=300.0, speeds=None, has_yaw=True, name='drive'):
    """A drive of the robot, with the counts of its wheels and the poses of its reference."""
    forward_mps, turning_radps = random_speeds(rng, duration_s) if speeds is None else speeds
    samples, half_m = len(forward_mps), 0.5 * robot.wheel_separation_m
    rims_m = np.column_stack((forward_mps - half_m * turning_radps, forward_mps + half_m * turning_radps)) / WHEEL_HZ
    radii_m = 0.5 * np.array(robot[:2])
    times_s, rolled_m = np.arange(1, samples + 1) / WHEEL_HZ, np.cumsum(rims_m, axis=0)
    turned_m = rolled_m + extra_travel(robot[-2:], times_s, rolled_m, robot.wheel_separation_m)
    angles_rad = rng.uniform(0.0, 2.0 * math.pi, 2) + turned_m / radii_m
    travels_m = rims_m + rng.normal(size=(samples, 2)) * np.sqrt(robot.slip_m2_per_m * abs(rims_m))
    turns_rad = np.diff(travels_m, axis=1)[:, 0] / robot.wheel_separation_m
    turns_rad += rng.normal(size=samples) * np.sqrt(robot.slip_rad2_per_rad * abs(turning_radps) / WHEEL_HZ)
    yaws_rad = np.cumsum(turns_rad)
    steps = travels_m.mean(axis=1) * np.exp(1j * (yaws_rad - 0.5 * turns_rad))
    count_rad = 2.0 * math.pi / robot.counts
    counted_rad = (np.floor(angles_rad / count_rad) + 0.5) * count_rad
    at_s = np.arange(BORDER_S, times_s[-1] - BORDER_S, 1.0 / robot.reference_hz) + rng.uniform(0.0, 1.0 / WHEEL_HZ)
    path = np.cumsum(steps)
    x_m, y_m, yaw_rad = (
        np.interp(at_s - robot.reference_delay_s, times_s, each) for each in (path.real, path.imag, yaws_rad)
    )
    place = (robot.reference_x_m + 1j * robot.reference_y_m) * np.exp(1j * yaw_rad)
    poses = np.column_stack((x_m + place.real, y_m + place.imag, yaw_rad + robot.reference_yaw_rad))
    poses += rng.normal(size=poses.shape) * [robot.noise_m, robot.noise_m, robot.noise_rad if has_yaw else math.nan]
    stamps_ns, reference_ns = (np.rint(1e9 * each).astype(np.int64) for each in (times_s, at_s))
    return ReferencedDrive(
        name, Drive(stamps_ns, counted_rad), Reference('camera', reference_ns, poses), (count_rad,) * 2
    )
