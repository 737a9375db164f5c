"""Wheel angles by inverse kinematics, from the recorded poses of odometry."""

from __future__ import annotations

import math
from typing import Iterator, Optional, Sequence, Tuple

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.pose_messages import StampedPose
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams

DEFAULT_SEED = 1


def start_angles_rad(seed: int) -> Tuple[float, float]:
    """Draw the angles of the left and the right wheel, each anywhere in a turn.

    Were both 0, the encoders would step together: on a straight drive their errors would cancel.
    """
    left_rad, right_rad = generator(seed, 'wheel_phase').uniform(0.0, 2.0 * math.pi, 2).tolist()
    return left_rad, right_rad


def start_angles_note(seed: int) -> str:
    """Say where the angles at the start are from."""
    return (
        f'where the wheels stood at the start is not known: drawn by --seed {seed}; with another seed, each encoder '
        f'rounds elsewhere, and its path ends elsewhere'
    )


# What the wheels' axle cannot do; less is rounding.
_SIDEWAYS_FRACTION = 0.01


class OdometryWheels:
    """Computes how the wheels of a robot that does not slip would have turned between one pose and the next."""

    ppr: Optional[PerWheel] = None  # of an encoder that nobody knows
    are_joint_angles = False

    def __init__(self, odometry: Reference, joints: Tuple[str, str], wheels: OdometryParams, seed: int) -> None:
        """Prepare to read.

        Args:
            odometry: a topic of poses, or two frames of /tf.
            joints: left, right: the names under which angles are given.
            wheels: diameter, separation, and where the axle is in the frame of the poses.
            seed: of the wheels' angles at the start.
        """
        self.topics: Tuple[str, ...] = odometry.topics
        self.joints = joints
        self.text = f'messages of {odometry.name} (wheel angles by inverse kinematics)'
        self._odometry = odometry
        self._wheels, self._axle = wheels, Pose2D(wheels.axle_x, 0.0, 0.0)
        self._last: Optional[Pose2D] = None
        self._seed = seed
        self._left_rad, self._right_rad = start_angles_rad(seed)
        self._along_m = self._sideways_m = 0.0

    def angles(self, message: Message) -> Sequence[JointValues]:
        """Return both wheels at every pose.

        Raises:
            InputFault: the message is torn, or its pose is not finite.
        """
        return [self._at(stamped) for stamped in self._odometry.poses(message)]

    def notes(self) -> Iterator[str]:
        """List what poses cannot show."""
        yield (
            f'the wheel angles are computed from the poses of {self._odometry.name}, with the diameter and separation '
            f'below: slip, and what the recorded encoder rounded, are in them as motion; a PPR adds its own rounding'
        )
        yield start_angles_note(self._seed)
        if self._sideways_m > _SIDEWAYS_FRACTION * self._along_m:
            yield (
                f'{self._odometry.name} moves {self._sideways_m:.2f} m sideways on {self._along_m:.2f} m ahead, which '
                f'two wheels on an axle cannot do: left out'
            )

    def _at(self, stamped: StampedPose) -> JointValues:
        axle = stamped.pose.compose(self._axle)
        if self._last is not None:
            self._move(axle.relative_to(self._last))
        self._last = axle
        return JointValues(stamped.stamp_ns, self.joints, (self._left_rad, self._right_rad))

    def _move(self, motion: Pose2D) -> None:
        """Turn the wheels by the arc whose chord is the motion: the inverse of `move_along_arc`."""
        half_turn_rad = 0.5 * motion.yaw_rad
        cos_half, sin_half = math.cos(half_turn_rad), math.sin(half_turn_rad)
        chord_m = cos_half * motion.x_m + sin_half * motion.y_m
        arc_m = chord_m * half_turn_rad / sin_half if sin_half else chord_m
        self._along_m += abs(arc_m)
        self._sideways_m += abs(cos_half * motion.y_m - sin_half * motion.x_m)
        apart_m = half_turn_rad * self._wheels.wheel_separation
        radius_m = 0.5 * self._wheels.wheel_diameter
        self._left_rad += (arc_m - apart_m) / radius_m
        self._right_rad += (arc_m + apart_m) / radius_m
