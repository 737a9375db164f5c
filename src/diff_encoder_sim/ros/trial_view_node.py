"""trial_view_node: what RViz needs beside the trial's own topics: the world, and both paths."""
from __future__ import annotations

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from visualization_msgs.msg import MarkerArray

from diff_encoder_sim.recording import topics
from diff_encoder_sim.ros.conversions import ns_from_stamp, world_markers
from diff_encoder_sim.ros.node import publisher, run_node, subscriber
from diff_encoder_sim.ros.trial_plan import required_trial_plan
from diff_encoder_sim.simulation.world import load_world
from diff_encoder_sim.timeline import Step, Timeline

MAP_FRAME = 'map'
POSES_PER_PATH_MESSAGE = 10  # a path is sent whole each time: twice a second is enough to watch


class PathTrail:
    """Collects a pose topic into a path topic."""

    def __init__(self, pose_topic: str, path_topic: str) -> None:
        self._path = Path()
        self._timeline = Timeline(tolerance_ns=0)
        self._paths = publisher(path_topic, Path, latch=True)
        self._poses = subscriber(pose_topic, PoseStamped, self._on_pose)

    def _on_pose(self, message: PoseStamped) -> None:
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
    """The world's walls as markers; odometry's path (through TF) against the true one."""

    def __init__(self) -> None:
        world = load_world(required_trial_plan().world)
        self._markers = publisher('world_markers', MarkerArray, latch=True)
        self._markers.publish(world_markers(world, MAP_FRAME))
        self._trails = [PathTrail(topics.GLOBAL_POSE, 'odom_path'),
                        PathTrail(topics.WORLD_POSE, 'world_pose_path')]


def main() -> None:
    """Entry point of the executable."""
    run_node('trial_view_node', TrialViewNode)
