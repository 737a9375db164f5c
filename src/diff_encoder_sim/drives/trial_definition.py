"""One run of a test, the files and rates that it is run with, and the trial that a reencoded bag is of."""

from __future__ import annotations

import enum
import math
from typing import Any, Dict, Literal, NamedTuple, Optional

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between, Duration_s, Length_m, Offset_m, Rate_Hz, Seed, TravelVariance_m
from diff_encoder_sim.base.params import Params, param
from diff_encoder_sim.base.per_wheel import WheelDiameter_m
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.topics import FILTERED, ODOM, BagFormat, PoseSource
from diff_encoder_sim.simulation.slip import CONTACT_CURVE_NOISE, CONTACT_DISTANCE_STD
from diff_encoder_sim.wheels.catalogue import resolution_text
from diff_encoder_sim.wheels.encoder_params import DEFAULT_PPR, CounterModulus, PulsesPerRevolution, encoder_label
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, CurveVariance, OdometryParams, RelativeStd
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

GOAL_DISTANCE_M = 0.5  # a robot that is farther from its goal has failed, whatever its pose estimate

# Final pose minus goal: x [m] and y [m] along the map's axes, yaw [rad] wrapped; None where the source had no pose.
FinalErrors = Dict[PoseSource, Optional[Pose2D]]


class Outcome(enum.Enum):
    """How a trial ended; all but SUCCEEDED are failures."""

    SUCCEEDED = 'succeeded'
    COLLISION = 'collision'  # it touched something other than the floor
    LOST = 'lost'  # localization gave up, or is wrong by more than GOAL_DISTANCE_M
    TIMED_OUT = 'timed_out'  # not at the end within the test's time_limit
    ABORTED = 'aborted'  # the navigator gave a goal up
    FAILED = 'failed'  # the ROS graph of a live trial did not come up, stalled or was stopped
    TORN = 'torn'  # the bag ends without a result

    @property
    def text(self) -> str:
        """Return the outcome as tables show it."""
        return self.value.replace('_', ' ')


class Ending(NamedTuple):
    """An outcome and, for a failure, its reason in one line."""

    outcome: Outcome
    reason: str = ''


class RouteFailed(Exception):
    """The route was not driven to its end: with the outcome and the reason."""

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.ending = Ending(outcome, reason)


def goal_error(true_pose_in_map: Pose2D, goal_in_map: Pose2D, limit_m: float = GOAL_DISTANCE_M) -> Optional[str]:
    """Return why a robot at this pose has failed to reach the goal, None where it is near enough."""
    away_m = math.hypot(true_pose_in_map.x_m - goal_in_map.x_m, true_pose_in_map.y_m - goal_in_map.y_m)
    return f'the robot stands {away_m:.2f} m from the goal; allowed: {limit_m:.2f} m' if away_m > limit_m else None


# Fields of Trial, by the parameters of which they have the names.
OF_ODOMETRY = ('wheel_diameter', 'wheel_separation', 'axle_x')
OF_ENCODER = ('left_joint', 'right_joint', 'left_reversed', 'right_reversed')
_OF_CATALOGUE = ('encoder', 'resolution')
_LEFT_OUT_IF_USUAL = ('axle_x', *OF_ENCODER, *_OF_CATALOGUE, 'variant', 'fusion', 'counter_modulus', *UNCERTAINTY_KEYS)


class Trial(Params):
    """One run of a test with one encoder and one seed; recorded in its bag."""

    test: TestDefinition
    ppr: PulsesPerRevolution = DEFAULT_PPR
    number: Seed = Field(0, description='the seed of all that varies between trials')
    odom: Literal['encoder', 'ideal'] = 'encoder'
    nav: Literal['scripted', 'embedded', 'upstream'] = 'scripted'
    fusion: Literal['none', 'embedded', 'upstream'] = Field('none', description='of odometry with an IMU')
    wheel_diameter: WheelDiameter_m = param(0.2, 'of the odometry [m]')
    wheel_separation: Length_m = Field(0.4, description='of the odometry [m]')
    axle_x: Offset_m = Field(0.0, description='of the odometry [m]')
    left_joint: str = Field('left_wheel_joint', description='left wheel in /joint_states')
    right_joint: str = Field('right_wheel_joint', description='right wheel in /joint_states')
    left_reversed: bool = Field(False, description='its angle falls when the robot drives forward')
    right_reversed: bool = Field(False, description='its angle falls when the robot drives forward')
    encoder: str = Field('', description='name of a real encoder, whose counts are `ppr`; empty: ideal')
    resolution: str = Field('', description='how its counts follow from the datasheet')
    variant: str = Field('', description='name of the set of parameters, where its campaign has several')
    counter_modulus: CounterModulus = 0
    # As of simulated wheels without errors.
    motion_noise: TravelVariance_m = Field(0.0, description="of the odometry's covariance [m^2/m]")
    curve_noise: CurveVariance = Field(CONTACT_CURVE_NOISE, description='of it, at 1 m/s^2 [m^2/m]')
    distance_std: RelativeStd = Field(CONTACT_DISTANCE_STD, description="of the odometry's covariance")
    turn_std: RelativeStd = Field(0.0, description="of the odometry's covariance")
    diameter_difference_std: RelativeStd = Field(0.0, description="of the odometry's covariance")

    @model_serializer(mode='wrap')
    def _without_the_usual(self, serialise: SerializerFunctionWrapHandler) -> Dict[str, Any]:
        """Leave out what is as in most trials: bags stay as they were before trials differed in it."""
        values, fields = serialise(self), type(self).model_fields
        usual = [name for name in _LEFT_OUT_IF_USUAL if getattr(self, name) == fields[name].default]
        return {name: value for name, value in values.items() if name not in usual}

    @property
    def encoder_label(self) -> str:
        """Return how tables and names of files call the encoder."""
        return encoder_label(self.ppr, self.encoder)

    @property
    def odometry_topic(self) -> str:
        """Return the topic of the odometry that navigation uses."""
        return ODOM if self.fusion == 'none' else FILTERED

    def goal(self) -> Pose2D:
        """Return the pose at which the robot is to end, in the map frame."""
        return self.test.drive_end() if self.nav == 'scripted' else self.test.goal()


class TrialPlan(Params):
    """A trial and the paths of its files."""

    trial: Trial
    world: str = Field(description='path of the world file')
    map: str = Field(description="path of its map's YAML file")
    bag: str = Field(description='path of the bag to record; empty for none')
    bag_format: BagFormat = Field('ros1', description='of a bag that is recorded in lockstep: ROS 1, or MCAP of ROS 2')
    slam: Literal['none', 'embedded', 'upstream'] = 'none'
    save_map: str = Field('', description='path, without suffix, of the map that SLAM makes')


class LivePlan(TrialPlan):
    """The parameter /trial: a plan with the rates that the nodes of a live graph must agree on."""

    report_rate: Rate_Hz = Field(description='of /odom and /global_pose [Hz]')
    report_delay: Duration_s = Field(0.0, description='by which they may come after the sample of the wheels [s]')
    command_period: Annotated[float, Between(0.0, 10_000.0, 's')] = Field(
        description='between commands on /cmd_vel [s]; 0: not waited for'
    )


def wheels_of(odometry: OdometryParams, encoder: EncoderParams) -> Dict[str, Any]:
    """Return the fields of Trial that computing odometry from the bag's pulses or angles needs."""
    of_odometry = {name: getattr(odometry, name) for name in OF_ODOMETRY}
    of_encoder = {name: getattr(encoder, name) for name in (*OF_ENCODER, 'counter_modulus')}
    return {**of_odometry, **odometry.uncertainty, **of_encoder}


def with_encoder(trial: Trial, encoder: EncoderParams, odometry: OdometryParams, name: str = '') -> Trial:
    """Return the same trial as if it had been driven with another encoder, which may have a name, and odometry."""
    counted = {'ppr': encoder.counts_per_turn, 'encoder': name, 'resolution': resolution_text(encoder.encoder)}
    return trial.model_copy(update={**counted, 'odom': 'encoder', 'fusion': 'none', **wheels_of(odometry, encoder)})
