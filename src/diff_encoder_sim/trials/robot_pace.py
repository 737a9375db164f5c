"""A test at the pace of a robot: no faster than its motors let it drive."""

from __future__ import annotations

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.simulation.drive import DriveParams
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive

# A day, as of the time limit of a route: a mistyped number must not drive for ever.
LONGEST_DRIVE_S = 86_400.0


def at_pace_of(drive: DriveParams, test: TestDefinition) -> TestDefinition:
    """Return the test with limits that the robot's motors allow.

    A drive without feedback that commands more would end short of its goal.

    Raises:
        ConfigError: the drive would take longer than LONGEST_DRIVE_S.
    """
    allowed = {
        'speed': drive.max_linear_speed,
        'acceleration': drive.max_linear_acceleration,
        'angular_speed': drive.max_angular_speed,
        'angular_acceleration': drive.max_angular_acceleration,
    }
    slower = {key: limit for key, limit in allowed.items() if limit < getattr(test.limits, key)}
    paced = test.model_copy(update={'limits': test.limits.model_copy(update=slower)}) if slower else test
    duration_s = ScriptedDrive(paced).duration_s
    if duration_s > LONGEST_DRIVE_S:
        raise ConfigError(
            f'test {test.name}: its drive takes {duration_s:.0f} s with the limits of test and robot; allowed: up to '
            f'{LONGEST_DRIVE_S:.0f} s'
        )
    return paced
