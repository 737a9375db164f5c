"""Wheel quality: how exact the radii and the separation are that odometry assumes."""

from __future__ import annotations

from typing import Dict, NamedTuple


class WheelQuality(NamedTuple):
    """Wheels whose geometry has random errors from robot to robot."""

    name: str  # of --wheels
    text: str
    std: float  # relative standard deviation of the ratio of the radii, and of the separation
    source: str

    @property
    def errors(self) -> Dict[str, float]:
        """Return the geometry errors by their names in `simulator.wheel_errors`; the radii are independent."""
        means = dict.fromkeys(('left_radius_error', 'right_radius_error', 'wheel_separation_error'), 0.0)
        return {**means, 'radius_spread': 0.5**0.5 * self.std, 'wheel_separation_spread': self.std}


ROBOT_FILE = WheelQuality('robot_file', 'the wheels of the robot file', 0.0, 'its errors or calibration')  # without std
EXACT = WheelQuality('exact', 'exact wheels', 0.0, 'an ideal robot')
BEST_STD = 1e-4  # of a ratio of radii by calibrate: docs/real_robots.md has 0.02 % at 95 %
# Borenstein and Feng (1996): UMBmark makes odometry at least ten times better than nominal dimensions.
CALIBRATED = WheelQuality('calibrated', 'wheels calibrated to 0.1 %', 0.001, 'as after UMBmark')
MEASURED = WheelQuality('measured', 'wheels measured to 0.5 %', 0.005, 'by caliper, 1 mm of 0.2 m')
UNCALIBRATED = WheelQuality('uncalibrated', 'uncalibrated wheels, to 1 %', 0.01, 'nominal size of tyres')
QUALITIES = {each.name: each for each in (EXACT, CALIBRATED, MEASURED, UNCALIBRATED)}
