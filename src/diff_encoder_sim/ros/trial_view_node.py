"""trial_view_node: what RViz needs beside the trial's own topics: the world, and the paths."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from visualization_msgs.msg import MarkerArray

from diff_encoder_sim.base.stamps import Step, Timeline
from diff_encoder_sim.recording import topics
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message, pose_stamped_message, world_markers
from diff_encoder_sim.ros.node import publisher, run_node, subscriber
from diff_encoder_sim.ros.trial_plan import required_trial_plan
from diff_encoder_sim.simulation.world import load_world

MAP_FRAME = 'map'
POSES_PER_PATH_MESSAGE = 10  # a path is sent whole each time: twice a second is enough to watch


class PathTrail:
    """Collects poses on the map into a path topic."""

    def __init__(self, path_topic: str) -> None:
        self._path = Path()
        self._timeline = Timeline(tolerance_ns=0)
        self._paths = publisher(path_topic, Path, latch=True)

    def add(self, message: PoseStamped) -> None:
        """One more pose; time that jumps back begins a new path."""
        step = self._timeline.advance(ns_from_stamp(message.header.stamp))
        if step is Step.RESTART:
            self._path.poses = []
        if step is Step.STALE:
            return
        self._path.header = message.header
        self._path.poses.append(message)
        if len(self._path.poses) % POSES_PER_PATH_MESSAGE == 0:
            self._paths.publish(self._path)


class TrialViewNode:
    """The world's walls as markers; the paths of odometry, of localization, and the true one."""

    def __init__(self) -> None:
        plan = required_trial_plan()
        self._start = plan.trial.test.start.pose()
        self._markers = publisher('world_markers', MarkerArray, latch=True)
        self._markers.publish(world_markers(load_world(plan.world), MAP_FRAME))
        self._odom_trail = PathTrail('odom_path')
        self._subscribers = [
            subscriber(topics.ODOM, Odometry, self._on_odom),
            subscriber(topics.GLOBAL_POSE, PoseStamped, PathTrail('global_pose_path').add),
            subscriber(topics.WORLD_POSE, PoseStamped, PathTrail('world_pose_path').add),
        ]

    def _on_odom(self, message: Odometry) -> None:
        """Odometry alone, from the surveyed start: where dead reckoning would be."""
        pose = self._start.compose(pose_from_message(message.pose.pose))
        self._odom_trail.add(pose_stamped_message(pose, ns_from_stamp(message.header.stamp), MAP_FRAME))


def main() -> None:
    """Entry point of the executable."""
    run_node('trial_view_node', TrialViewNode)
