"""A robot as every command uses it: its file, what was found out about it, and the settings that follow."""

from __future__ import annotations

from typing import Any, Dict, Mapping, NamedTuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import did_you_mean
from diff_encoder_sim.robots.derived_settings import derived_settings
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.proposed_laser import proposed_laser, proposed_laser_line
from diff_encoder_sim.robots.robot_choices import RobotChoices
from diff_encoder_sim.robots.robot_description import RobotDescription
from diff_encoder_sim.robots.robot_file import RobotFile
from diff_encoder_sim.robots.urdf_parsing import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expand

# Settings in which a robot file overrides what would be found out; of several the first that is given.
_CHOICES = {
    'left_joint': ('simulator.left_joint', 'config.left_joint'),
    'right_joint': ('simulator.right_joint', 'config.right_joint'),
    'laser_link': ('simulator.laser_link',),
    'wheel_diameter': ('simulator.wheel_diameter',),
    'wheel_separation': ('simulator.wheel_separation',),
}
_NUMBERS = ('wheel_diameter', 'wheel_separation')

MOST_LINKS = 12  # in an error


class RobotSetup(NamedTuple):
    """A robot, ready to be simulated and navigated."""

    file: RobotFile
    description: RobotDescription
    settings: Dict[str, Any]  # values of parameters by dotted keys: the URDF's, and before them the robot file's

    @property
    def name(self) -> str:
        """Return the robot's name in its URDF, which is that of its model in the simulation."""
        return self.description.tree.name

    def check_laser(self) -> None:
        """Check that there is a laser: closed-loop trials need one.

        Raises:
            ConfigError: none was found.
        """
        if self.description.laser is None:
            links = self.description.tree.links
            shown = ', '.join(list(links)[:MOST_LINKS]) + (', ...' if len(links) > MOST_LINKS else '')
            raise ConfigError(
                f'{self.file.where}: the robot has no laser, which closed-loop trials need; allowed: '
                f'{proposed_laser_line(self.description)}, or simulator.laser_link, one of the links {shown}'
            )

    def with_laser(self) -> RobotSetup:
        """Return the robot with a laser, if it has none: one that a warning proposes.

        Raises:
            ConfigError: as `set_up_robot`.
        """
        if self.description.laser is not None:
            return self
        warning = f'no laser is found: one above the robot is simulated, as by {proposed_laser_line(self.description)}'
        source = self.file.source._replace(added_laser=proposed_laser(self.description))
        setup = set_up_robot(self.file._replace(source=source))
        warnings = (*setup.description.warnings, warning)
        return setup._replace(description=setup.description._replace(warnings=warnings))


def set_up_robot(file: RobotFile) -> RobotSetup:
    """Find out about a robot; what its file sets goes before what is found.

    Raises:
        ConfigError: its description cannot be read, or is no differential drive.
    """
    _check_added_laser(file)
    description = describe(file.source, _choices(file.overrides, file.where))
    return RobotSetup(file, description, {**derived_settings(description), **file.overrides})


def _check_added_laser(file: RobotFile) -> None:
    """Check the place of a laser here, where an error can name the robot file."""
    laser = file.source.added_laser
    if laser is None:
        return
    links = parse_urdf(expand(file.source._replace(added_laser=None)), str(file.source.file)).links
    if laser.parent not in links:
        raise ConfigError(
            f'{file.where}: laser: parent: given {laser.parent!r}; allowed: a link of {file.source.file.name}'
            f'{did_you_mean(laser.parent, links)}'
        )


def _choices(overrides: Mapping[str, Any], where: str) -> RobotChoices:
    given = {
        choice: next((overrides[key] for key in keys if key in overrides), None) for choice, keys in _CHOICES.items()
    }
    for choice, value in given.items():
        kind, allowed = ((int, float), 'a number') if choice in _NUMBERS else (str, 'a name')
        if value is not None and (isinstance(value, bool) or not isinstance(value, kind)):
            raise ConfigError(f'{where}: {_CHOICES[choice][0]}: given {value!r}; allowed: {allowed}')
    return RobotChoices(**{choice: value or None for choice, value in given.items()})
