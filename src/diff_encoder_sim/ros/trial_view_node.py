"""trial_view_node: publishes what RViz shows besides the trial's own topics: the world, and paths."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from visualization_msgs.msg import MarkerArray

from diff_encoder_sim.base.stamps import Step, Timeline
from diff_encoder_sim.drives import topics
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message, pose_stamped_message, world_markers
from diff_encoder_sim.ros.encoded_topics import stamped_subscriber
from diff_encoder_sim.ros.node import publisher, required_trial_plan, run_node
from diff_encoder_sim.simulation.world import load_world

MAP_FRAME = 'map'
POSES_PER_PATH_MESSAGE = 10  # each message has the whole path: twice a second is enough for a display


class PathTrail:
    """Collects poses in the map frame and publishes them as a path."""

    def __init__(self, path_topic: str) -> None:
        self._path = Path()
        self._timeline = Timeline(tolerance_ns=0)
        self._paths = publisher(path_topic, Path, latch=True)

    def add(self, message: PoseStamped) -> None:
        """Add a pose; time that jumps back starts a new path."""
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
    """Publishes the world's walls as markers, and the paths of odometry, pose estimate and true pose."""

    def __init__(self) -> None:
        plan = required_trial_plan()
        self._start = plan.trial.test.start.pose()
        self._markers = publisher('world_markers', MarkerArray, latch=True)
        self._markers.publish(world_markers(load_world(plan.world), MAP_FRAME))
        self._odom_trail = PathTrail('odom_path')
        self._subscribers = [
            stamped_subscriber(topics.ODOM, Odometry, self._on_odom),
            stamped_subscriber(topics.GLOBAL_POSE, PoseStamped, PathTrail('global_pose_path').add),
            stamped_subscriber(topics.WORLD_POSE, PoseStamped, PathTrail('world_pose_path').add),
        ]

    def _on_odom(self, message: Odometry) -> None:
        """Add odometry's pose, from the surveyed start on: dead reckoning on the map."""
        pose = self._start.compose(pose_from_message(message.pose.pose))
        self._odom_trail.add(pose_stamped_message(pose, ns_from_stamp(message.header.stamp), MAP_FRAME))


def main() -> None:
    """Run the node."""
    run_node('trial_view_node', TrialViewNode)
