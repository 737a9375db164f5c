"""The calibration in a robot file: geometry, place of the reference sensor and slip, each with an interval of 95 %."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Optional

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator
from typing_extensions import Annotated, get_args

from diff_encoder_sim.base.bounds import Angle_rad, Between, Length_m, Offset_m, SignedDuration_s, TravelVariance_m
from diff_encoder_sim.base.params import Line, Params, not_allowed

SlipVariance_rad = Annotated[float, Between(0.0, 100.0, 'rad^2/rad')]
Number = Annotated[float, Between(-1e6, 1e6)]
RelativeCovariance = Annotated[float, Between(-1.0, 1.0)]

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


def _in_bounds_of(kind: Any) -> AfterValidator:
    bounds: Between = get_args(kind)[1]

    def check(estimate: Estimate) -> Estimate:
        if not all(map(bounds.allows, (estimate.value, *estimate.interval))):
            raise ValueError(str(bounds))
        return estimate

    return AfterValidator(check)


class CalibratedDrive(Params):
    """A recorded drive of which the calibration is."""

    file: Line = Field(min_length=1, description='as it was given to calibrate')
    sha256: str = Field(pattern='^[0-9a-f]{64}$', description='of its content')


class CalibrationParams(Params):
    """What drives with a reference determine of a robot; calibrate writes it."""

    left_wheel_diameter_m: Annotated[Estimate, _in_bounds_of(Length_m)] = Field(description='[m]')
    right_wheel_diameter_m: Annotated[Estimate, _in_bounds_of(Length_m)] = Field(description='[m]')
    wheel_separation_m: Annotated[Estimate, _in_bounds_of(Length_m)] = Field(
        description='between the contact points [m]'
    )
    reference_x_m: Annotated[Estimate, _in_bounds_of(Offset_m)] = Field(
        description='of the reference sensor, in base_frame [m]'
    )
    reference_y_m: Annotated[Estimate, _in_bounds_of(Offset_m)] = Field(description='likewise, to the left [m]')
    reference_yaw_rad: Optional[Annotated[Estimate, _in_bounds_of(Angle_rad)]] = Field(
        None, description='counter-clockwise against the robot [rad]; none if the reference has no yaw'
    )
    reference_delay_s: Annotated[Estimate, _in_bounds_of(SignedDuration_s)] = Field(
        description='positive if the reference reports the pose of an earlier time [s]'
    )
    slip_m2_per_m: Annotated[Estimate, _in_bounds_of(TravelVariance_m)] = Field(
        description="variance of each wheel's travel per metre of it [m^2/m]"
    )
    slip_rad2_per_rad: Annotated[Estimate, _in_bounds_of(SlipVariance_rad)] = Field(
        description='additional variance of the heading per radian turned [rad^2/rad]'
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

    def settings(self) -> Dict[str, Any]:
        """Return the parameters of odometry by dotted keys: geometry, and the standard deviations of its errors.

        Diameters or a separation that are undetermined are left out, so that those of the robot hold.
        """
        left_m, right_m, covariance = self.left_wheel_diameter_m, self.right_wheel_diameter_m, self.geometry_covariance
        stds = {key: math.sqrt(max(0.0, float(row @ np.array(covariance) @ row))) for key, row in _ERRORS.items()}
        geometry: Dict[str, Any] = {}
        if not {'left_wheel_diameter_m', 'right_wheel_diameter_m'} & {*self.undetermined}:
            geometry['config.wheel_diameter'] = {'left': left_m.value, 'right': right_m.value}
        if 'wheel_separation_m' not in self.undetermined:
            geometry['config.wheel_separation'] = self.wheel_separation_m.value
        return {
            **geometry,
            'config.motion_noise': self.slip_m2_per_m.value,
            **{f'config.{key}': float(f'{std:.6g}') for key, std in stds.items()},
        }
