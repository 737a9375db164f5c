"""Inertial measurement units (IMUs): samples, parameters of their errors, and commercial ones by name."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Tuple

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between, PositiveDuration_s
from diff_encoder_sim.base.params import Line, Params, flat, load_params, param
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.base.yaml_files import find_yaml

NO_IMU = 'none'  # in place of a name

# The greatest Allan deviation of a first-order Gauss-Markov process, at 1.89 times its correlation time, over the
# process's standard deviation.
PEAK_ALLAN_DEVIATION = 0.61736

Vector = Tuple[float, float, float]
Magnitude = Annotated[float, Between(0.0, 1e4)]
RelativeError = Annotated[float, Between(0.0, 0.5)]


class InertialSensorParams(Params):
    """Errors of three axes, in units of the measured quantity: [rad/s] of a gyroscope, [m/s^2] of an accelerometer."""

    noise_density: Magnitude = param(0.0, 'white noise [unit/sqrt(Hz)]; of a gyroscope, the angle random walk')
    bias: Magnitude = param(0.0, 'standard deviation of the constant offset of each axis [unit]; drawn by the seed')
    bias_instability: Magnitude = param(0.0, 'floor of the Allan deviation [unit]: greatest one of the bias drift')
    bias_time: PositiveDuration_s = param(100.0, 'correlation time of the bias drift [s]')
    scale_error: RelativeError = param(0.0, 'standard deviation of the scale error of each axis, relative')
    misalignment: RelativeError = param(0.0, 'standard deviation of the sensitivity to each other axis [rad]')
    resolution: Magnitude = param(0.0, 'one step of the output [unit]; 0: continuous')
    range: Magnitude = param(0.0, 'largest output [unit]; 0: unlimited')

    @property
    def bias_drift(self) -> float:
        """Standard deviation of the bias drift, a Gauss-Markov process of `bias_time` [unit]."""
        return self.bias_instability / PEAK_ALLAN_DEVIATION

    @property
    def bias_std(self) -> float:
        """Standard deviation of the constant offset and its drift together [unit]."""
        return math.hypot(self.bias, self.bias_drift)

    def noise_variance(self, rate_hz: float) -> float:
        """Return the variance of white noise and quantisation of a sample at a rate [unit^2]."""
        return self.noise_density**2 * rate_hz + self.resolution**2 / 12.0

    def integral_variance(self, rate_hz: float) -> float:
        """Return the variance by white noise and quantisation of the integral over a second [unit^2 s]."""
        return self.noise_variance(rate_hz) / rate_hz


class ImuParams(Params):
    """Parameters of an IMU at base_link, with its axes; without errors by default."""

    gyroscope: InertialSensorParams = param(InertialSensorParams(), 'errors of the angular velocity [rad/s]')
    accelerometer: InertialSensorParams = param(InertialSensorParams(), 'errors of the specific force [m/s^2]')
    rate: Annotated[float, Between(0.1, 100.0, 'Hz')] = param(100.0, 'samples per second [Hz]')
    latency: Annotated[float, Between(0.0, 10.0, 's')] = param(0.0, 'from a sample to its message [s]')
    frame: str = Field('imu_link', min_length=1, description='frame of the samples')

    @property
    def period_ns(self) -> int:
        """Time from sample to sample."""
        return round(NANOSECONDS_PER_SECOND / self.rate)

    @property
    def latency_ns(self) -> int:
        """Time from a sample to its message."""
        return round(self.latency * NANOSECONDS_PER_SECOND)


class ImuSample(NamedTuple):
    """A measurement in the IMU's frame; at rest the specific force is gravity, upwards (REP-145)."""

    stamp_ns: int
    angular_velocity_radps: Vector
    linear_acceleration_mps2: Vector


class ImuFileParams(Params):
    """The keys of an IMU's file; config/imu/ has patterns."""

    manufacturer: Line = Field(min_length=1, description='as on the datasheet')
    part: Line = Field(min_length=1, description='part number')
    type: Line = Field(min_length=1, description='principle and form, such as MEMS chip')
    link: Line = Field('', pattern='^(https://.*)?$', description='address of its documentation')
    source: List[Annotated[Line, Field(min_length=1)]] = Field(
        min_length=1, description='datasheets and measurements; comments call them [1], [2], ...'
    )
    price: Line = Field(min_length=1, description='class of its price, such as hobby')
    imu: ImuParams


def load_imu(given: str, config_folder: Path, folder: Path) -> ImuFileParams:
    """Load an IMU by name in config/imu, or a .yaml file by its path from `folder`; ConfigError if missing or bad."""
    return load_params(ImuFileParams, find_yaml('imu', given, config_folder / 'imu', folder))


def imu_settings(given: str, config_folder: Path, folder: Path) -> Dict[str, Any]:
    """Return the parameters of an IMU by dotted keys, `simulator.imu.rate`; none for '' and `none`; see `load_imu`."""
    if given in ('', NO_IMU):
        return {}
    imu = load_imu(given, config_folder, folder).imu
    return {f'simulator.imu.{key}': value for key, value in flat(imu.model_dump())}
