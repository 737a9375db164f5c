"""A kinematic robot in a room, for navigation.test: what it publishes, and how it follows commands."""

import math
import time

import numpy as np
import ros_testing as ros
from geometry_msgs.msg import PolygonStamped, Twist
from move_base_msgs.msg import MoveBaseActionResult
from nav_msgs.msg import OccupancyGrid, Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.se2 import Pose2D, move_along_arc
from diff_encoder_sim.ros.messages import pose_message

NODE = '/move_base'
ODOM_IN_MAP = Pose2D(0.5, -0.3, 0.4)
LASER_IN_BASE = Pose2D(0.12, 0.0, 0.0)
RAYS, RANGE_MIN, RANGE_MAX = 180, 0.15, 6.0

# Solids of the room [m]: x from, x to, y from, y to. The walls, one across the room, and a closed cell in a corner.
SOLIDS = [
    (-3.2, 3.2, -2.2, -2.0),
    (-3.2, 3.2, 2.0, 2.2),
    (-3.2, -3.0, -2.2, 2.2),
    (3.0, 3.2, -2.2, 2.2),
    (0.4, 0.6, -2.0, 0.4),
    (1.6, 1.8, 0.6, 2.0),
    (1.6, 3.0, 0.6, 0.8),
]


def room_map():
    """The room as a map message, cells of 5 cm."""
    resolution, low, cells = 0.05, (-3.5, -2.5), np.zeros((100, 140), np.int8)
    for x_from, x_to, y_from, y_to in SOLIDS:
        columns = slice(round((x_from - low[0]) / resolution), round((x_to - low[0]) / resolution))
        rows = slice(round((y_from - low[1]) / resolution), round((y_to - low[1]) / resolution))
        cells[rows, columns] = 100
    message = OccupancyGrid(data=cells.ravel().tolist())
    message.header.frame_id = 'map'
    message.info.resolution, message.info.width, message.info.height = resolution, 140, 100
    message.info.origin = pose_message(Pose2D(*low, 0.0))
    return message


def ranges_from(laser):
    """(RAYS,) distance to the nearest solid around a laser in the map frame."""
    bearings = laser.yaw_rad + np.arange(RAYS) * 2.0 * math.pi / RAYS
    boxes = np.array(SOLIDS)
    with np.errstate(divide='ignore', invalid='ignore'):
        x = (boxes[:, None, :2] - laser.x_m) / np.cos(bearings)[None, :, None]
        y = (boxes[:, None, 2:] - laser.y_m) / np.sin(bearings)[None, :, None]
    enters = np.maximum(x.min(axis=2), y.min(axis=2))
    leaves = np.minimum(x.max(axis=2), y.max(axis=2))
    return np.where((enters <= leaves) & (enters > 0.0), enters, ros.INF).min(axis=0)


class Robot:
    """Lives in periods of 50 ms: reports where it is and what it sees, and follows the answer."""

    def __init__(self, start_ns):
        self.now_ns, self.pose, self.twist = start_ns, Pose2D(-2.0, -1.0, 0.0), (0.0, 0.0)
        self.muted = set()  # of '/odom', '/scan', '/tf'
        self.change_scan = self.change_odometry = unchanged
        self._periods, self._is_answered = 0, False
        self.commands = ros.Collector('/cmd_vel', Twist)
        self.results = ros.Collector(NODE + '/result', MoveBaseActionResult)
        self.sent = set()  # ids of all goals
        self._outlines = ros.Collector(NODE + '/local_costmap/footprint', PolygonStamped)
        kinds = {'/clock': Clock, '/tf': TFMessage, '/scan': LaserScan, '/odom': Odometry, '/tf_static': TFMessage}
        self._publishers = {topic: ros.connected_publisher(topic, kind, [NODE]) for topic, kind in kinds.items()}
        laser = ros.transform_message(LASER_IN_BASE, start_ns, 'base_link', 'laser')
        self._publishers['/tf_static'].publish(TFMessage([laser]))

    def pose_in_odom(self):
        return self.pose.relative_to(ODOM_IN_MAP)

    def place(self, pose):
        self.pose, self.twist = pose, (0.0, 0.0)

    def live(self, periods=1):
        for _ in range(periods):
            self._live()

    def live_until(self, condition, what, timeout_s=ros.TIMEOUT_S):
        """Returns the first true value of `condition()` after a period."""

        def state():
            last = [twist_of(message) for message in self.commands.messages[-5:]]
            return f'{what() if callable(what) else what}; robot at {tuple(self.pose)}, last commands {last}'

        return ros.wait_until(lambda: self._live() or condition(), state, timeout_s, pause_s=0.0)

    def _live(self):
        self.now_ns += ros.PERIOD_NS
        stamp = ros.stamp_from_ns(self.now_ns)
        heard = len(self.commands.messages)
        self._publishers['/clock'].publish(Clock(stamp))
        if '/tf' not in self.muted:
            self._publishers['/tf'].publish(TFMessage([ros.transform_message(ODOM_IN_MAP, self.now_ns, 'map', 'odom')]))
        if '/scan' not in self.muted and self._periods % 2 == 0:
            self._publishers['/scan'].publish(self.change_scan(self._scan(stamp)))
        if '/odom' not in self.muted:
            self._publishers['/odom'].publish(self.change_odometry(self._odometry(stamp)))
        self._periods += 1
        self._follow(heard)

    def _follow(self, heard):
        """An answer is waited for where one must come: while a goal is on and the node hears odometry."""
        is_heard = '/odom' not in self.muted and self.change_odometry is unchanged
        is_due = self._is_answered and is_heard
        deadline = time.monotonic() + (5.0 if is_due else 0.01)
        while len(self.commands.messages) == heard and time.monotonic() < deadline:
            if is_due and not self.pending():
                break
            time.sleep(0.0005)
        if is_heard and not is_due:
            self._let_it_catch_up()
        commands = self.commands.messages
        self._is_answered = len(commands) > heard and bool(self.pending())
        if commands:
            self.twist = twist_of(commands[-1])
        self.pose = move_along_arc(self.pose, 0.05 * self.twist[0], 0.05 * self.twist[1])

    def _let_it_catch_up(self):
        """Without commands: the node shows the robot's outline every 200 ms, so far it has come for sure."""
        deadline = time.monotonic() + 1.0
        while time.monotonic() < deadline:
            outlines = self._outlines.messages[-1:]
            if not outlines or ros.stamp_ns_of(outlines[0]) >= self.now_ns - 5 * ros.PERIOD_NS:
                return
            time.sleep(0.0005)

    def pending(self):
        """Ids of the goals without a result."""
        return self.sent - {result.status.goal_id.id for result in self.results.messages}

    def _scan(self, stamp):
        scan = LaserScan(
            angle_increment=2.0 * math.pi / RAYS,
            range_min=RANGE_MIN,
            range_max=RANGE_MAX,
            ranges=ranges_from(self.pose.compose(LASER_IN_BASE)).tolist(),
        )
        scan.header.stamp, scan.header.frame_id = stamp, 'laser'
        return scan

    def _odometry(self, stamp):
        message = Odometry(child_frame_id='base_link')
        message.header.stamp, message.header.frame_id = stamp, 'odom'
        message.twist.twist.linear.x, message.twist.twist.angular.z = self.twist
        message.pose.pose = pose_message(self.pose_in_odom())
        return message


def twist_of(message):
    return message.linear.x, message.angular.z


def unchanged(message):
    return message


def with_ranges(value):
    """A change of a scan: every range is `value`."""

    def change(scan):
        scan.ranges = [value] * len(scan.ranges)
        return scan

    return change
