"""replay_node: plays a recorded drive to the encoder and the odometry node, and records their topics.

`rosbag play` publishes the wheel angles, and the true poses of a trial, without recorded odometry, transforms and
counts. It plays a copy of these topics, which also supports ROS 2 bags and truncated bags. It starts when the live
nodes have subscribed; the launch ends with it.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from pathlib import Path

import rosgraph
import rospy
from pydantic import Field
from std_msgs.msg import String
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between, PositiveDuration_s
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import users_path
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.joint_wheels import WheelOptions, find_wheels
from diff_encoder_sim.drives.reencoding import COPIED, copied_topics
from diff_encoder_sim.drives.ros1_copy import write_ros1_copy
from diff_encoder_sim.drives.trial_definition import OF_ODOMETRY, with_encoder
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node
from diff_encoder_sim.ros.recorder import Recorder
from diff_encoder_sim.wheels.encoder_params import ppr_label
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

RECORDED = (topics.ENCODER_PULSE, topics.ENCODER_VELOCITY, topics.ODOM, topics.TF, topics.TRIAL, *COPIED)

POLL_PERIOD_S = 0.1
# Wall time before a repeated last message, because rosbag play loses queued messages at its end.
FLUSH_S = 0.5
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
        self._bag = users_path(self._params.bag)
        name = f'{self._bag.stem}_{ppr_label(encoder.counts_per_turn)}ppr_replay.bag'
        self._out = users_path(self._params.out or str(Path('bags') / name))
        if self._out.exists():
            raise ConfigError(f'out: {self._out} exists; allowed: the path of a new file')
        with open_source(self._bag) as source:
            options = WheelOptions(
                self._params.joint_states, left_joint=encoder.left_joint, right_joint=encoder.right_joint
            )
            wheels = find_wheels(self._bag, source, options, encoder)
            self._copied = copied_topics(source)
            trial = trial_of_source(self._bag, source)
        if wheels.message_type != topics.JOINT_STATE_TYPE:
            raise ConfigError(
                f'{self._bag}: {wheels.topic} has counts; expected {topics.JOINT_STATE_TYPE}; reencode can use counts'
            )
        self._topic = wheels.topic
        self._recorder = Recorder(self._out, RECORDED)
        if trial is not None:
            for name in OF_ODOMETRY:
                used, recorded = getattr(odometry, name), getattr(trial, name)
                if used != recorded:
                    log.warning("%s: %g is used, %g was used in the bag's trial: see robot:=", name, used, recorded)
            self._trial = publisher(topics.TRIAL, String, latch=True)
            self._trial.publish(String(with_encoder(trial, encoder, odometry).model_dump_json()))

    def run(self) -> None:
        """Play and record; returns at the end of the drive."""
        try:
            self._wait_for_subscribers()
            with tempfile.TemporaryDirectory(prefix='replay_') as folder:
                self._play(Path(folder) / 'drive.bag')
        except ConfigError:
            self._recorder.discard()
            raise
        while time.monotonic() - self._recorder.last_message_s < QUIET_S:
            time.sleep(POLL_PERIOD_S)
        self._recorder.finish()
        if not rospy.is_shutdown():
            log.info('replay finished; bag: %s; shutting down', self._out)
            self._status.succeed()

    def _wait_for_subscribers(self) -> None:
        """Wait until the encoder node and the odometry node have subscribed.

        Raises:
            ConfigError: a node has not subscribed within start_timeout.
        """
        master = rosgraph.Master(rospy.get_name())
        deadline_s = time.monotonic() + self._params.start_timeout
        while not rospy.is_shutdown():
            subscribers = {topic: set(nodes) - {rospy.get_name()} for topic, nodes in master.getSystemState()[1]}
            missing = [topic for topic in (topics.JOINT_STATES, topics.ENCODER_PULSE) if not subscribers.get(topic)]
            if not missing:
                return
            if time.monotonic() > deadline_s:
                raise ConfigError(
                    f'no node has subscribed to {", ".join(missing)} within {self._params.start_timeout:.0f} s; '
                    'expected the nodes that replay.launch starts'
                )
            time.sleep(POLL_PERIOD_S)

    def _play(self, played: Path) -> None:
        """Copy all readable messages of the topics to a file, and run rosbag play on it.

        Raises:
            ConfigError: rosbag play failed, or the file cannot be written.
        """
        try:
            with open_source(self._bag) as source:
                flush_ns = round(FLUSH_S * self._params.speed * NANOSECONDS_PER_SECOND)
                write_ros1_copy(played, source, (self._topic, *self._copied), again_after_ns=flush_ns)
                if source.fault:
                    log.warning('%s: %s; all messages that can be read are played', self._bag, source.fault)
        except OSError as error:
            raise ConfigError(f'{played}: cannot be written: {error.strerror}') from None
        # An unlimited queue delays messages to a busy subscriber instead of dropping them.
        options = ['--quiet', '--clock', '--wait-for-subscribers', '--delay', '1', '--queue', '0']
        player = subprocess.Popen(
            ['rosbag', 'play', *options, f'--rate={self._params.speed}', str(played), f'{self._topic}:=/joint_states'],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        while player.poll() is None and not rospy.is_shutdown():
            time.sleep(POLL_PERIOD_S)
        player.terminate()
        output, _ = player.communicate()
        if player.returncode and not rospy.is_shutdown():
            raise ConfigError(f'{self._bag}: rosbag play: {" ".join(output.split())}')


def main(status: LaunchStatus) -> None:
    """Run the node."""
    run_node('replay_node', lambda: ReplayNode(status), ReplayNode.run)
