"""global_pose_node: publishes the pose estimate on TF, map -> base_link, as /global_pose at a steady rate."""

from __future__ import annotations

import threading
from typing import Dict

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped
from pydantic import Field

from diff_encoder_sim.base.bounds import Rate_Hz
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.stamps import Step, Timeline
from diff_encoder_sim.drives.wire import encode_header, encode_pose
from diff_encoder_sim.ros.conversions import ns_from_stamp
from diff_encoder_sim.ros.encoded_topics import EncodedPublisher
from diff_encoder_sim.ros.node import log, node_params, run_node, trial_plan
from diff_encoder_sim.ros.transform_buffer import TransformBuffer
from diff_encoder_sim.wheels.sampling import DEFAULT_RATE_HZ, BoundarySampler


class GlobalPoseParams(Params):
    """Parameters of global_pose_node."""

    map_frame: str = Field('map', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    rate: Rate_Hz = Field(DEFAULT_RATE_HZ, description='poses per second of stamps [Hz]')


class GlobalPoseNode:
    """Looks up map -> base_link whenever a transform arrives, and publishes it once in each period.

    Only new transforms are published: while the chain is broken or has stopped, no old pose is repeated.
    """

    def __init__(self) -> None:
        self._params = node_params(GlobalPoseParams, part='global_pose', defaults=_trial_defaults())
        self._lock = threading.Lock()  # each publisher of /tf comes in a thread of its own
        self._restart()
        self._poses = EncodedPublisher('global_pose', PoseStamped)
        self._buffer = TransformBuffer()
        self._buffer.listen(self._publish)

    def _restart(self) -> None:
        self._sampler = BoundarySampler(self._params.rate)
        self._timeline = Timeline(tolerance_ns=0)

    def _publish(self) -> None:
        with self._lock:
            self._publish_newest()

    def _publish_newest(self) -> None:
        try:
            transform = self._buffer.lookup_transform(self._params.map_frame, self._params.base_frame, rospy.Time(0))
        except tf2_ros.TransformException as error:
            frames = self._params.map_frame, self._params.base_frame
            log.info('no pose estimate: no transform %s -> %s (%s)', *frames, str(error).rstrip('. '))
            return
        stamp_ns = ns_from_stamp(transform.header.stamp)
        step = self._timeline.advance(stamp_ns)
        if step is Step.RESTART:
            self._restart()
        if step is Step.STALE or self._sampler.period_index(stamp_ns) is None:
            return
        position, rotation = transform.transform.translation, transform.transform.rotation
        pose = encode_pose((position.x, position.y, position.z), (rotation.x, rotation.y, rotation.z, rotation.w))
        self._poses.publish(encode_header(stamp_ns, transform.header.frame_id) + pose)


def _trial_defaults() -> Dict[str, float]:
    plan = trial_plan()
    return {} if plan is None else {'rate': plan.report_rate}


def main() -> None:
    """Run the node."""
    run_node('global_pose_node', GlobalPoseNode)
