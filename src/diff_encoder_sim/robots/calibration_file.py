"""The calibration in a robot file: geometry, place of the reference sensor and slip, each with an interval of 95 %."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Optional

import numpy as np
from pydantic import Field, field_validator, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.params import Line, Params, not_allowed

Number = Annotated[float, Between(-1e6, 1e6)]
NotNegative = Annotated[float, Between(0.0, 1e6)]
RelativeCovariance = Annotated[float, Between(-1.0, 1.0)]

SLIP_BY_MOTION = 'simulator.wheel_errors.slip'

# Parameters of odometry: relative errors of distances, turns and the diameters' difference, by the errors of left
# diameter, right diameter and separation.
_ERRORS = {'distance_std': (0.5, 0.5, 0.0), 'turn_std': (0.5, 0.5, -1.0), 'diameter_difference_std': (-1.0, 1.0, 0.0)}


class Estimate(Params):
    """An estimated number."""

    value: Number = Field(description='the most likely value')
    interval: List[Number] = Field(min_length=2, max_length=2, description='low and high, of 95 %')

    @model_validator(mode='after')
    def _check_order(self) -> Estimate:
        if not self.interval[0] <= self.value <= self.interval[1]:
            raise not_allowed('interval', self.interval, f'low and high around the value, {self.value}')
        return self


class Magnitude(Estimate):
    """An estimated number that is not negative."""

    value: NotNegative = Field(description='the most likely value')
    interval: List[NotNegative] = Field(min_length=2, max_length=2, description='low and high, of 95 %')


class CalibratedDrive(Params):
    """A recorded drive of which the calibration is."""

    file: Line = Field(min_length=1, description='as it was given to calibrate')
    sha256: str = Field(pattern='^[0-9a-f]{64}$', description='of its content')


class CalibrationParams(Params):
    """What drives with a reference determine of a robot; calibrate writes it."""

    left_wheel_diameter_m: Magnitude = Field(description='[m]')
    right_wheel_diameter_m: Magnitude = Field(description='[m]')
    wheel_separation_m: Magnitude = Field(description='between the contact points [m]')
    reference_x_m: Estimate = Field(description='of the reference sensor, in base_frame [m]')
    reference_y_m: Estimate = Field(description='likewise, to the left [m]')
    reference_yaw_rad: Optional[Estimate] = Field(
        None, description='counter-clockwise against the robot [rad]; none if the reference has no yaw'
    )
    reference_delay_s: Estimate = Field(description='positive if the reference reports the pose of an earlier time [s]')
    slip_m2_per_m: Magnitude = Field(description="variance of a wheel's travel per metre of it [m^2/m]")
    slip_rad2_per_rad: Magnitude = Field(description='extra variance of the heading per radian turned [rad^2/rad]')
    slip_by_acceleration: Optional[Estimate] = Field(
        None, description='slip per longitudinal acceleration of a wheel, if estimated [1/(m/s^2)]'
    )
    slip_by_lateral_acceleration: Optional[Estimate] = Field(
        None, description='likewise of the outer wheel per lateral acceleration, less of the inner one [1/(m/s^2)]'
    )
    geometry_covariance: List[List[RelativeCovariance]] = Field(
        description='of the logarithms of left diameter, right diameter and separation'
    )
    undetermined: List[str] = Field([], description='keys that the drives do not determine, with usual values')
    drives: List[CalibratedDrive] = Field(min_length=1, description='the recorded drives')

    @field_validator('geometry_covariance')
    @classmethod
    def _check_covariance(cls, rows: List[List[float]]) -> List[List[float]]:
        matrix = np.array(rows) if [len(row) for row in rows] == [3, 3, 3] else -np.eye(3)
        rounding = 1e-6 * abs(matrix.trace())  # of written numbers
        if not np.allclose(matrix, matrix.T, atol=rounding) or np.linalg.eigvalsh(matrix).min() < -rounding:
            raise ValueError('3 rows of 3, symmetric and positive semidefinite')
        return rows

    @property
    def slip_by_motion(self) -> Dict[str, float]:
        """Return the slip by motion as parameters of the simulator, by dotted keys."""
        found = {'acceleration': self.slip_by_acceleration, 'lateral_acceleration': self.slip_by_lateral_acceleration}
        return {f'{SLIP_BY_MOTION}.{key}': estimate.value for key, estimate in found.items() if estimate}

    def settings(self) -> Dict[str, Any]:
        """Return the parameters of odometry by dotted keys, without diameters or separation that are undetermined."""
        covariance = np.array(self.geometry_covariance)
        stds = {key: math.sqrt(max(0.0, float(row @ covariance @ row))) for key, row in _ERRORS.items()}
        settings: Dict[str, Any] = {'config.motion_noise': self.slip_m2_per_m.value}
        settings.update({f'config.{key}': float(f'{std:.6g}') for key, std in stds.items()})
        if not {'left_wheel_diameter_m', 'right_wheel_diameter_m'} & {*self.undetermined}:
            diameters_m = self.left_wheel_diameter_m.value, self.right_wheel_diameter_m.value
            settings['config.wheel_diameter'] = dict(zip(('left', 'right'), diameters_m))
        if 'wheel_separation_m' not in self.undetermined:
            settings['config.wheel_separation'] = self.wheel_separation_m.value
        return settings
