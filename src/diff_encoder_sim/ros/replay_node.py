"""replay_node: plays a recorded drive to the encoder and the odometry node, and records their topics.

It publishes the wheel angles, and the true poses of a trial, without recorded odometry, transforms and counts.
"""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import Optional

import rospy
from geometry_msgs.msg import PoseStamped
from pydantic import Field
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between, PositiveDuration_s
from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.package_files import users_path
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.joint_wheels import find_wheels
from diff_encoder_sim.drives.message_encoders import encode_clock
from diff_encoder_sim.drives.reencoding import COPIED, copied_topics
from diff_encoder_sim.drives.trial_bag import EARLIEST_NS
from diff_encoder_sim.drives.trial_definition import OF_ODOMETRY, with_encoder
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.drives.typestore import to_ros1
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.messages import Publisher
from diff_encoder_sim.ros.node import executable, log, node_params, wait_until_connected
from diff_encoder_sim.ros.pacing import WallPacer
from diff_encoder_sim.ros.recorder import Recorder
from diff_encoder_sim.wheels.encoder_params import ppr_label
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

RECORDED = (topics.ENCODER_PULSE, topics.ENCODER_VELOCITY, topics.ODOM, topics.TF, topics.TRIAL, *COPIED)
COPIED_CLASSES = {topics.WORLD_POSE: PoseStamped, topics.TRIAL_RESULT: String}

# Encoder and odometry advertise these when they have subscribed to their inputs.
STARTED = ('/clock', topics.JOINT_STATES, topics.ENCODER_PULSE, topics.ODOM)
POLL_PERIOD_S = 0.1
QUIET_S = 1.0  # wall time without a message that ends the recording


class ReplayParams(Params):
    """Parameters of replay_node, next to those of the encoder and the odometry."""

    bag: str = Field(min_length=1, description='bag of ROS 1 or ROS 2 with wheel angles (JointState)')
    out: str = Field('', description='path of the new bag; empty: bags/BAG_PPRppr_replay.bag')
    joint_states: str = Field('', description='topic of the wheel angles; empty: the only one of its type')
    speed: Annotated[float, Between(1e-3, 100.0)] = Field(1.0, description='played time per recorded time')
    start_timeout: PositiveDuration_s = Field(60.0, description='wall time for the graph to start [s]')


class ReplayNode:
    """Replays one drive, from its first message to its last."""

    def __init__(self, status: LaunchStatus) -> None:
        self._status = status
        self._params = node_params(ReplayParams, EncoderParams, OdometryParams, part='config')
        encoder = node_params(EncoderParams, OdometryParams, ReplayParams, part='config')
        odometry = node_params(OdometryParams, EncoderParams, ReplayParams, part='config')
        bag = users_path(self._params.bag)
        name = f'{bag.stem}_{ppr_label(encoder.counts_per_turn)}ppr_replay.bag'
        self._out = users_path(self._params.out or str(Path('bags') / name))
        if self._out.exists():
            raise ConfigError(f'out: {self._out} exists; allowed: the path of a new file')
        self._source = open_source(bag)
        choices = self._params.joint_states, '', encoder.left_joint, encoder.right_joint
        topic, kind, _ = find_wheels(self._source, encoder, *choices)
        copied = copied_topics(self._source)
        trial = trial_of_source(self._source)
        if kind != topics.JOINT_STATE_TYPE:
            expected = f'expected {topics.JOINT_STATE_TYPE}; reencode can use counts'
            raise ConfigError(f'{bag}: {topic} has counts; {expected}')
        self._recorder = Recorder(self._out, RECORDED)
        self._clock = Publisher('/clock', Clock)
        self._played = {topic: Publisher(topic, COPIED_CLASSES[topic]) for topic in copied}
        self._played[topic] = Publisher(topics.JOINT_STATES, JointState)
        if trial is not None:
            for name in OF_ODOMETRY:
                used, recorded = getattr(odometry, name), getattr(trial, name)
                if used != recorded:
                    log.warning("%s: %g is used, %g was used in the bag's trial: see robot:=", name, used, recorded)
            info = with_encoder(trial, encoder, odometry).model_dump_json()
            Publisher(topics.TRIAL, String, latch=True).publish(String(info))

    def run(self) -> None:
        """Play and record; returns at the end of the drive."""
        timeout_s = self._params.start_timeout
        missing = wait_until_connected(STARTED, RECORDED, timeout_s)
        if missing:
            self._recorder.finish(is_kept=False)
            given = f'topics not connected within {timeout_s:.0f} s: {", ".join(missing)}'
            raise ConfigError(f'{given}; expected the nodes that replay.launch starts')
        self._play()
        while time.monotonic() - self._recorder.last_message_s < QUIET_S:
            time.sleep(POLL_PERIOD_S)
        self._recorder.finish()
        if not rospy.is_shutdown():
            log.info('replay finished; bag: %s; shutting down', self._out)
            self._status.succeed()

    def _play(self) -> None:
        """Publish all readable messages of the topics in the order of the file, each with its time on /clock."""
        pacer: Optional[WallPacer] = None
        now_ns = EARLIEST_NS
        source = self._source
        for message in source.messages(tuple(self._played)):
            with contextlib.suppress(InputFault):  # a torn message, which no node could read
                content = to_ros1(message.raw, source.topics[message.topic]) if source.is_cdr else message.raw
                now_ns = max(message.time_ns, now_ns)
                pacer = pacer or WallPacer(self._params.speed, now_ns)
                pacer.wait(now_ns)
                if rospy.is_shutdown():
                    return
                self._clock.publish(encode_clock(now_ns))
                self._played[message.topic].publish(content)
        if source.fault:
            log.warning('%s: %s; all messages that can be read are played', source.path, source.fault)


main = executable('replay_node', ReplayNode, ReplayNode.run)
