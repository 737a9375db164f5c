"""A test at the pace of a robot: no faster than its motors let it drive."""

from __future__ import annotations

from diff_encoder_sim.simulation.drive import DriveParams
from diff_encoder_sim.trials.test_definition import TestDefinition


def at_pace_of(drive: DriveParams, test: TestDefinition) -> TestDefinition:
    """Return the test with limits that the robot's motors allow.

    A drive without feedback that commands more would end short of its goal.
    """
    allowed = {
        'speed': drive.max_linear_speed,
        'acceleration': drive.max_linear_acceleration,
        'angular_speed': drive.max_angular_speed,
        'angular_acceleration': drive.max_angular_acceleration,
    }
    slower = {key: limit for key, limit in allowed.items() if limit < getattr(test.limits, key)}
    return test.model_copy(update={'limits': test.limits.model_copy(update=slower)}) if slower else test
