"""The bag that reencoding writes for a PPR: what the live nodes would have published."""

from __future__ import annotations

from pathlib import Path
from typing import List, Tuple

from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.pose_messages import encode_odometry, encode_planar_tf
from diff_encoder_sim.drives.sensor_messages import (
    decode_string,
    encode_encoder_pulse,
    encode_string,
    encode_wheel_speeds,
)
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.wheel_source import DriveStream
from diff_encoder_sim.drives.wire import NUMBER_SIZE, POSE, FieldReader, encode_header
from diff_encoder_sim.wheels.odometry import OdometryEstimate
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample

# The truth, and how a trial ended: copied as they are, with the node that published them.
COPIED = {topics.WORLD_POSE: topics.WORLD_POSE_NODE, topics.TRIAL_RESULT: topics.NAVIGATION_TRIAL_NODE}


def copied_topics(source: DriveStream) -> List[str]:
    """List the topics of `COPIED` that a bag has with a trial's types."""
    known = topics.recorded_topics('full')
    return [topic for topic in COPIED if source.topics.get(topic) == known[topic].message_type]


class ReencodedBag(TrialBag):
    """Writes what the nodes would have published, at the time of the message that led to it.

    Memory does not grow with the bag.
    """

    def __init__(self, path: Path, joints: Tuple[str, str], params: OdometryParams) -> None:
        """Open the bag; `joints` are left, right, `params` have the frames, and whether there is a transform."""
        super().__init__(path, 'full')
        self._joints, self._params = joints, params

    def encoder_pulse(self, time_ns: int, sample: EncoderSample) -> None:
        """Write /encoder_pulse and, where speeds are measured, /encoder_velocity."""
        if sample.wheel_rates_radps is not None:
            speeds = sample.stamp_ns, sample.wheel_rates_radps, self._joints
            self.publish(topics.ENCODER_VELOCITY, topics.ENCODER_NODE, time_ns, encode_wheel_speeds, *speeds)
        self.publish(topics.ENCODER_PULSE, topics.ENCODER_NODE, time_ns, encode_encoder_pulse, sample, self._joints)

    def odometry(self, time_ns: int, estimate: OdometryEstimate) -> None:
        """Write /odom, and odom->base_link to /tf."""
        frames = self._params.odom_frame, self._params.base_frame
        if self._params.publish_tf:
            transform = estimate.base_pose_in_odom, estimate.stamp_ns, *frames
            self.publish(topics.TF, topics.ODOM_NODE, time_ns, encode_planar_tf, *transform)
        self.publish(topics.ODOM, topics.ODOM_NODE, time_ns, encode_odometry, estimate, *frames)

    def trial(self, time_ns: int, trial: Trial) -> None:
        """Write /trial."""
        self.publish(topics.TRIAL, topics.NAVIGATION_TRIAL_NODE, time_ns, encode_string, trial.model_dump_json())

    def copy(self, message: Message, is_cdr: bool) -> None:
        """Write a message of `COPIED` as it is, in ROS 1's encoding.

        Raises:
            InputFault: a message of ROS 2 is torn.
        """
        raw = _of_cdr(message) if is_cdr else message.raw
        self.publish(message.topic, COPIED[message.topic], message.time_ns, bytes, raw)


def _of_cdr(message: Message) -> bytes:
    """Return a message of `COPIED`, a String or a PoseStamped, in ROS 1's encoding."""
    if message.topic == topics.TRIAL_RESULT:
        return encode_string(decode_string(message.raw, is_cdr=True))
    fields = FieldReader(message.raw, is_cdr=True)
    return encode_header(*fields.header()) + POSE.pack(*fields.unpack(POSE, NUMBER_SIZE))
