"""An inertial measurement unit (IMU): the true motion of its body, with the errors of each axis."""

from __future__ import annotations

import math
from collections import deque
from typing import Callable, Deque, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.imu import ImuParams, ImuSample, Vector
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

AXES = 6  # of the gyroscope, then of the accelerometer
BLOCK = 256  # samples whose random numbers are drawn at once

# Columns of the table of axes. An output is sensitive to the three axes of its sensor.
SENSITIVITY, BIAS, DRIFT, DRIFT_KEPT, DRIFT_NOISE, NOISE, RESOLUTION, RANGE, COLUMNS = 0, 3, 4, 5, 6, 7, 8, 9, 10


AT_ORIGIN = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)


class Imu:
    """Measures the motion of the body that it is mounted on, one sample in each period."""

    def __init__(
        self,
        params: ImuParams,
        gravity_mps2: float,
        rng: np.random.Generator,
        pose_in_body: Tuple[Vector, Tuple[float, float, float, float]] = AT_ORIGIN,
    ) -> None:
        """Draw the sensitivities, the offsets and the first drift of all axes; the body is at rest.

        The pose is a position [m] and a quaternion x, y, z, w.
        """
        self._position_m, quat_xyzw = np.array(pose_in_body[0]), pose_in_body[1]
        imu_from_body = np.array([_rotated_back(*quat_xyzw, *axis) for axis in np.eye(3).tolist()]).T
        self._rng, self._table = rng, np.zeros((AXES, COLUMNS))
        self._normals, self._used = np.empty((0, 2 * AXES)), 0
        self._velocity_mps = np.zeros(3)  # of the IMU at the last sample, along the body's axes
        self._gravity_mps2, self._period_s = gravity_mps2, params.period_ns / NANOSECONDS_PER_SECOND
        self._period_ns, self._latency_ns = params.period_ns, params.latency_ns
        self._waiting: Deque[ImuSample] = deque()  # for their messages
        for sensor, rows in ((params.gyroscope, self._table[:3]), (params.accelerometer, self._table[3:])):
            scales = 1.0 + sensor.scale_error * rng.standard_normal(3)
            cross = sensor.misalignment * rng.standard_normal((3, 3))
            np.fill_diagonal(cross, 1.0)
            kept = math.exp(-self._period_s / sensor.bias_time)
            rows[:, SENSITIVITY : SENSITIVITY + 3] = scales[:, None] * cross @ imu_from_body
            rows[:, BIAS] = sensor.bias * rng.standard_normal(3)
            rows[:, DRIFT] = sensor.bias_drift * rng.standard_normal(3)
            rows[:, DRIFT_KEPT] = kept
            rows[:, DRIFT_NOISE] = sensor.bias_drift * math.sqrt(1.0 - kept * kept)
            rows[:, NOISE] = sensor.noise_density * math.sqrt(params.rate)
            rows[:, RESOLUTION] = sensor.resolution
            rows[:, RANGE] = sensor.range or math.inf

    def step(self, now_ns: int, motion: Callable[[], Sequence[float]]) -> Optional[ImuSample]:
        """Measure the motion of the body if a sample is due; return the sample whose message is due now, if any.

        Call it once in each tick.
        """
        if now_ns % self._period_ns == 0:
            gx, gy, gz, ax, ay, az = self.measure(np.array([motion()]))[0].tolist()
            self._waiting.append(ImuSample(now_ns, (gx, gy, gz), (ax, ay, az)))
        if self._waiting and self._waiting[0].stamp_ns + self._latency_ns <= now_ns:
            return self._waiting.popleft()
        return None

    def measure(self, motions: np.ndarray) -> np.ndarray:
        """Return (n, 6) angular velocity [rad/s] and specific force [m/s^2] of the next n samples.

        Motions (n, 10) are the body's orientation x, y, z, w, velocity [m/s] and angular velocity [rad/s] in the world
        frame. Samples are the same, bit for bit, however many are measured at once.
        """
        end = self._used + len(motions)
        if end > len(self._normals):
            drawn = self._rng.standard_normal((max(BLOCK, len(motions)), 2 * AXES))
            self._normals = np.concatenate([self._normals[self._used :], drawn])
            self._used, end = 0, len(motions)
        normals, self._used = self._normals[self._used : end], end
        outputs: np.ndarray = _measure(
            motions, normals, self._table, self._position_m, self._velocity_mps, self._gravity_mps2, self._period_s
        )
        return outputs


@compiled
def _measure(
    motions: Array,
    normals: Array,
    table: Array,
    position_m: Array,
    velocity_mps: Array,
    gravity_mps2: float,
    period_s: float,
) -> np.ndarray:
    """Return (n, 6) outputs for (n, 10) motions and (n, 12) normals.

    The position (3,) of the IMU is in the body. Updates the drift in the table (6, COLUMNS), and the velocity (3,) of
    the IMU along the body's axes.
    """
    outputs, true = np.empty((len(motions), AXES)), np.empty(AXES)
    for sample in range(len(motions)):
        x, y, z, w = motions[sample, 0], motions[sample, 1], motions[sample, 2], motions[sample, 3]
        vx, vy, vz = _rotated_back(x, y, z, w, motions[sample, 4], motions[sample, 5], motions[sample, 6])
        wx, wy, wz = _rotated_back(x, y, z, w, motions[sample, 7], motions[sample, 8], motions[sample, 9])
        # The velocity of another point of a rigid body: v + w x r.
        vx += wy * position_m[2] - wz * position_m[1]
        vy += wz * position_m[0] - wx * position_m[2]
        vz += wx * position_m[1] - wy * position_m[0]
        up_x, up_y, up_z = _rotated_back(x, y, z, w, 0.0, 0.0, gravity_mps2)
        # In the turning frame of the body, a = dv/dt + w x v, with the mean velocity of the period.
        mx, my, mz = 0.5 * (velocity_mps[0] + vx), 0.5 * (velocity_mps[1] + vy), 0.5 * (velocity_mps[2] + vz)
        true[0], true[1], true[2] = wx, wy, wz
        true[3] = (vx - velocity_mps[0]) / period_s + wy * mz - wz * my + up_x
        true[4] = (vy - velocity_mps[1]) / period_s + wz * mx - wx * mz + up_y
        true[5] = (vz - velocity_mps[2]) / period_s + wx * my - wy * mx + up_z
        velocity_mps[0], velocity_mps[1], velocity_mps[2] = vx, vy, vz
        for axis in range(AXES):
            row, first = table[axis], axis - axis % 3
            value = row[BIAS] + row[DRIFT] + row[NOISE] * normals[sample, axis]
            for other in range(3):
                value += row[SENSITIVITY + other] * true[first + other]
            row[DRIFT] = row[DRIFT_KEPT] * row[DRIFT] + row[DRIFT_NOISE] * normals[sample, AXES + axis]
            value = min(max(value, -row[RANGE]), row[RANGE])
            if row[RESOLUTION] > 0.0:
                value = math.floor(value / row[RESOLUTION] + 0.5) * row[RESOLUTION]
            outputs[sample, axis] = value
    return outputs


@compiled
def _rotated_back(x: float, y: float, z: float, w: float, ax: float, ay: float, az: float) -> Vector:
    """Return a vector (ax, ay, az) of a parent frame in a frame of orientation x, y, z, w."""
    # a + 2 q x (q x a + w a), with q of the inverse rotation.
    tx, ty, tz = 2.0 * (z * ay - y * az), 2.0 * (x * az - z * ax), 2.0 * (y * ax - x * ay)
    return ax + w * tx + (z * ty - y * tz), ay + w * ty + (x * tz - z * tx), az + w * tz + (y * tx - x * ty)
