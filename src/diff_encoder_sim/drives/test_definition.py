"""What a test asks of the robot, as the YAML files of config/tests/ define it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import List, Optional, Union

from pydantic import Field, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.bounds import Between, Place_m, Turns
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import Params, load_params
from diff_encoder_sim.base.se2 import Pose2D, move_along_arc, wrap_angle
from diff_encoder_sim.base.yaml_files import find_yaml


class PoseParams(Params):
    """A pose on the floor, as users write it."""

    x: Place_m = Field(0.0, description='[m]')
    y: Place_m = Field(0.0, description='[m]')
    yaw: bounds.Angle_rad = Field(0.0, description='counter-clockwise [rad]')

    def pose(self) -> Pose2D:
        """Return the pose with its heading wrapped to [-pi, pi)."""
        return Pose2D(self.x, self.y, wrap_angle(self.yaw))


class Segment(Params):
    """One segment of a scripted drive: a straight line or turns in place."""

    # A mistyped number must not drive for hours: a scripted drive has no time limit.
    straight: Optional[Annotated[float, Between(-1000.0, 1000.0, 'm')]] = Field(
        None, description='distance, negative is backwards [m]'
    )
    turns: Optional[Turns] = Field(None, description='full turns, counter-clockwise')

    @model_validator(mode='after')
    def _check_one_motion(self) -> Segment:
        if (self.straight is None) == (self.turns is None):
            raise ValueError('either straight or turns')
        return self


class Point(Params):
    """A point on the floor."""

    x: Place_m = Field(description='[m]')
    y: Place_m = Field(description='[m]')


class Leg(Params):
    """One leg of a route that is navigated: a goal, waypoints, or turns in place."""

    goal: Optional[PoseParams] = Field(None, description='pose in the map frame at which the robot stops')
    through: Optional[List[Point]] = Field(
        None, min_length=1, max_length=10_000, description='waypoints, passed without stopping, in this order'
    )
    turns: Optional[Turns] = Field(None, description='full turns in place by the estimated pose, counter-clockwise')

    @model_validator(mode='after')
    def _check_one_kind(self) -> Leg:
        if sum(part is not None for part in (self.goal, self.through, self.turns)) != 1:
            raise ValueError('one of goal, through, turns')
        return self


class SpeedLimits(Params):
    """Speeds and accelerations of a scripted drive and of turns in place: the paper's table 2 unless changed."""

    speed: bounds.PositiveSpeed_mps = Field(0.45, description='highest speed [m/s]')
    acceleration: bounds.PositiveAcceleration_mps2 = Field(0.7, description='highest acceleration [m/s^2]')
    angular_speed: bounds.PositiveTurnRate_radps = Field(1.0, description='highest turning rate [rad/s]')
    angular_acceleration: bounds.PositiveTurnAcceleration_radps2 = Field(
        4.9, description='highest angular acceleration [rad/s^2]'
    )


class TestDefinition(Params):
    """A test: a world, a start, a route to navigate, and a drive without feedback."""

    __test__ = False  # pytest would take the class for one of its own

    name: str = Field(
        min_length=1, max_length=60, pattern=r'^[A-Za-z0-9][A-Za-z0-9_.+-]*$', description='part of file names'
    )
    world: str = Field(min_length=1, description='file in worlds/ without its suffix, or a path')
    start: PoseParams = Field(PoseParams(), description='pose of the robot in the map frame')
    drive: List[Segment] = Field([], max_length=1000, description='what nav:=scripted drives, without feedback')
    route: List[Leg] = Field([], max_length=1000, description='what is navigated; the last leg is a goal')
    pass_radius: Annotated[float, Between(1e-3, 1000.0, 'm')] = Field(
        0.5, description='distance that counts as passing a waypoint [m]'
    )
    time_limit: Annotated[float, Between(0.1, 86_400.0, 's')] = Field(
        600.0, description='simulated time after which a route has failed [s]'
    )
    limits: SpeedLimits = Field(SpeedLimits(), description='speeds of the scripted drive')

    @model_validator(mode='after')
    def _check_drive_or_route(self) -> TestDefinition:
        if not (self.drive or self.route):
            raise ValueError('a drive, a route, or both')
        if self.route and self.route[-1].goal is None:
            raise ValueError('a route whose last leg is a goal')
        return self

    def goal(self) -> Pose2D:
        """Return the pose at which the route, or else the drive, is to end, in the map frame."""
        last_goal = self.route[-1].goal if self.route else None
        return self.drive_end() if last_goal is None else last_goal.pose()

    def check_drivable(self, nav: str) -> None:
        """Raise ConfigError if the test has no drive for scripted navigation, or no route for any other."""
        if nav == 'scripted' and not self.drive:
            raise ConfigError(f'nav: given scripted, but {self.name} has no drive; allowed: embedded, upstream')
        if nav != 'scripted' and not self.route:
            raise ConfigError(f'nav: given {nav}, but {self.name} has no route; allowed: scripted')

    def drive_end(self) -> Pose2D:
        """Return the pose at which the scripted drive ends without slip or collision, in the map frame."""
        pose = self.start.pose()
        for segment in self.drive:
            pose = move_along_arc(pose, segment.straight or 0.0, 2.0 * math.pi * (segment.turns or 0.0))
        return pose._replace(yaw_rad=wrap_angle(pose.yaw_rad))


def load_test(name: str, config_folder: Union[str, Path], folder: Path = Path()) -> TestDefinition:
    """Load a test by its name (`SL` is config/tests/SL.yaml) or its file, relative to `folder`; ConfigError if bad."""
    return load_params(TestDefinition, find_yaml('test', name, Path(config_folder, 'tests'), folder))


def find_world(name: str, worlds_folder: Union[str, Path]) -> Path:
    """Return the path of a world file given by its path or by its name under worlds/; ConfigError if there is none."""
    for path in (Path(name), Path(worlds_folder) / name, Path(worlds_folder) / f'{name}.world'):
        if path.is_file():
            return path.resolve()
    known = ', '.join(sorted(file.stem for file in Path(worlds_folder).glob('*.world')))
    raise ConfigError(f'world: given {name!r}; allowed: {known}, or a .world file')
