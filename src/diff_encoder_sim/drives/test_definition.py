"""What a test asks of the robot, as the YAML files of config/tests/ define it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, Literal, Optional, Tuple, Union

from pydantic import ConfigDict, Field, SerializerFunctionWrapHandler, model_serializer, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.bounds import Between, Place_m, Turns
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import Params, load_params, param
from diff_encoder_sim.base.rounding import rounded, turns_text
from diff_encoder_sim.base.se2 import Pose2D, move_along_arc, wrap_angle
from diff_encoder_sim.base.yaml_files import find_yaml
from diff_encoder_sim.simulation.slip import FloorArea


class PoseParams(Params):
    """A pose on the floor, as users write it."""

    x: Place_m = Field(0.0, description='[m]')
    y: Place_m = Field(0.0, description='[m]')
    yaw: bounds.Angle_rad = Field(0.0, description='counter-clockwise [rad]')

    def pose(self) -> Pose2D:
        """Return the pose with its heading wrapped to [-pi, pi)."""
        return Pose2D(self.x, self.y, wrap_angle(self.yaw))


# A mistyped number must not drive for hours: a scripted drive has no time limit.
SegmentLength_m = Annotated[float, Between(-1000.0, 1000.0, 'm')]


class Arc(Params):
    """An arc of a scripted drive."""

    radius: SegmentLength_m = Field(description="of the path of the axle's middle, negative is backwards [m]")
    turns: Turns = Field(description='full turns of the heading, counter-clockwise')


class Pivot(Params):
    """A turn about a wheel, which stands still."""

    wheel: Literal['left', 'right'] = Field(description='the wheel that stands still')
    turns: Turns = Field(description='full turns of the heading, counter-clockwise')


class Segment(Params):
    """One segment of a scripted drive."""

    straight: Optional[SegmentLength_m] = Field(None, description='distance, negative is backwards [m]')
    turns: Optional[Turns] = Field(None, description='full turns in place, counter-clockwise')
    arc: Optional[Arc] = Field(None, description='radius and turns')
    pivot: Optional[Pivot] = Field(None, description='wheel and turns')
    stop: Optional[Annotated[float, Between(0.0, 3600.0, 's')]] = Field(
        None, description='time at rest, in addition to the half second after each segment [s]'
    )

    @model_validator(mode='after')
    def _check_one_motion(self) -> Segment:
        if len(self.model_dump(exclude_none=True)) != 1:
            raise ValueError(f'one of {", ".join(type(self).model_fields)}')
        return self

    @model_serializer(mode='wrap')
    def _without_unset_newer_kinds(self, serialise: SerializerFunctionWrapHandler) -> Dict[str, Any]:
        """Leave out keys that older bags and campaigns do not have, so that these stay equal."""
        return {
            key: value for key, value in serialise(self).items() if value is not None or key in ('straight', 'turns')
        }

    @property
    def motion(self) -> Tuple[float, float]:
        """Return the distance of the axle's middle [m] and the turn [rad]; of a pivot only `on_wheels` knows them."""
        if self.arc is not None:
            turn_rad = 2.0 * math.pi * self.arc.turns
            return self.arc.radius * abs(turn_rad), turn_rad
        return self.straight or 0.0, 2.0 * math.pi * (self.turns or 0.0)

    @property
    def turned(self) -> float:
        """Return the full turns in either direction."""
        return abs(self.pivot.turns if self.pivot else self.motion[1] / (2.0 * math.pi))

    def on_wheels(self, wheel_separation_m: float) -> Segment:
        """Return a pivot as the arc of the axle's middle around the standing wheel; other segments unchanged."""
        if self.pivot is None:
            return self
        is_forward = (self.pivot.wheel == 'left') == (self.pivot.turns > 0.0)
        return Segment(arc=Arc(radius=(0.5 if is_forward else -0.5) * wheel_separation_m, turns=self.pivot.turns))


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
    angular_acceleration: bounds.PositiveTurnAcceleration_radps2 = param(4.9, 'highest angular acceleration [rad/s^2]')


class TestDefinition(Params):
    """A test: a world, a start, a route to navigate, and a drive without feedback."""

    __test__ = False  # pytest would take the class for one of its own
    model_config = ConfigDict(populate_by_name=True)  # `drive` is the older name of `path`

    name: str = Field(
        min_length=1, max_length=60, pattern=r'^[A-Za-z0-9][A-Za-z0-9_.+-]*$', description='part of file names'
    )
    world: str = Field(min_length=1, description='file in worlds/ without its suffix, or a path')
    start: PoseParams = Field(PoseParams(), description='pose of the robot in the map frame')
    drive: List[Segment] = Field(
        [],
        alias='path',
        max_length=1000,
        description='segments that nav:=scripted drives, without feedback; or `drive`',
    )
    route: List[Leg] = Field([], max_length=1000, description='what is navigated; the last leg is a goal')
    pass_radius: Annotated[float, Between(1e-3, 1000.0, 'm')] = Field(
        0.5, description='distance that counts as passing a waypoint [m]'
    )
    time_limit: Annotated[float, Between(0.1, 86_400.0, 's')] = Field(
        600.0, description='simulated time after which a route has failed [s]'
    )
    limits: SpeedLimits = Field(SpeedLimits(), description='speeds of the scripted drive')
    floor: List[FloorArea] = Field(
        [], max_length=1000, description='areas with other friction; where they overlap, the last one counts'
    )

    @model_serializer(mode='wrap')
    def _without_unset_floor(self, serialise: SerializerFunctionWrapHandler) -> Dict[str, Any]:
        """Leave out the key that older bags and campaigns do not have."""
        return {key: value for key, value in serialise(self).items() if key != 'floor' or value}

    @model_validator(mode='after')
    def _check_drive_or_route(self) -> TestDefinition:
        if not (self.drive or self.route):
            raise ValueError('a path, a route, or both')
        if self.route and self.route[-1].goal is None:
            raise ValueError('a route whose last leg is a goal')
        return self

    def goal(self) -> Pose2D:
        """Return the pose at which the route, or else the drive, is to end, in the map frame."""
        last_goal = self.route[-1].goal if self.route else None
        return self.drive_end() if last_goal is None else last_goal.pose()

    @property
    def text(self) -> str:
        """Describe the motion for readers who do not know the test: `20 m straight in the world hallway`."""
        if self.route:
            places = [self.start, *(each for leg in self.route for each in leg.through or filter(None, [leg.goal]))]
            steps_m = [math.hypot(end.x - start.x, end.y - start.y) for start, end in zip(places, places[1:])]
            turned, path = sum(abs(leg.turns or 0.0) for leg in self.route), f'past {len(places) - 2} waypoints'
        else:
            steps_m = [segment.motion[0] for segment in self.drive]
            turned, path = sum(segment.turned for segment in self.drive), f'in {sum(map(bool, steps_m))} parts'
        distance_m = sum(map(abs, steps_m))
        moved = f'{distance_m:.3g} m {"straight" if sum(map(bool, steps_m)) == 1 else path}'
        turning = f'{turns_text(rounded(turned, 3))}{"" if distance_m else " in place"}'
        texts = [moved] * bool(distance_m) + [turning] * bool(turned) or ['rest']
        return f'{" and ".join(texts)} in the world {self.world}'

    def check_drivable(self, nav: str) -> None:
        """Raise ConfigError if the test has no drive for scripted navigation, or no route for any other."""
        if nav == 'scripted' and not self.drive:
            raise ConfigError(f'nav: given scripted, but {self.name} has no path; allowed: embedded, upstream')
        if nav != 'scripted' and not self.route:
            raise ConfigError(f'nav: given {nav}, but {self.name} has no route; allowed: scripted, advise --no-trials')

    def drive_end(self) -> Pose2D:
        """Return the pose at which the scripted drive ends without slip or collision, in the map frame."""
        pose = self.start.pose()
        for segment in self.drive:
            pose = move_along_arc(pose, *segment.motion)
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
