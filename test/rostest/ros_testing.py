"""What the rostests share: talking to nodes without losing a message, and waiting on conditions.

Every wait ends as soon as its condition holds; a timeout is only how long a broken node is given before the test fails.
"""

import logging
import math
import threading
import time
import unittest
import warnings

import rosgraph
import rospy
from geometry_msgs.msg import TransformStamped
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import LaserScan

from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.drives.message_encoders import encode_scan, encode_transform
from diff_encoder_sim.ros.messages import header, stamp_from_ns

__all__ = ['header', 'stamp_from_ns']  # next to what is defined here

TIMEOUT_S = 20.0
NS_PER_S = 1000000000
PERIOD_NS = 50000000  # 20 Hz
NAN, INF = float('nan'), float('inf')


def start_test_node(name):
    """A node for the test itself; its own /rosout stays out of the way."""
    rospy.init_node(name, log_level=rospy.ERROR)
    logging.getLogger('rosout').setLevel(logging.ERROR)


def scan_message(scan, frame, period_s):
    """A scan as a message; `period_s` is the time between scans."""
    return LaserScan().deserialize(encode_scan(scan, frame, period_s))


def transform_message(child_pose, stamp_ns, parent_frame, child_frame):
    """A frame's planar pose in its parent as a message."""
    return TransformStamped().deserialize(encode_transform(child_pose, stamp_ns, parent_frame, child_frame))


def wait_until(condition, what, timeout_s=TIMEOUT_S, pause_s=0.005):
    """Return the first true value of `condition()`; fail the test when there is none in time."""
    deadline = time.monotonic() + timeout_s
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise AssertionError(f'waited {timeout_s:.0f} s in vain for {what() if callable(what) else what}')
        time.sleep(pause_s)


def stamp_ns_of(message):
    return message.header.stamp.to_nsec()


def yaw_of(quaternion):
    """Return the yaw of a rotation about z, which is what the nodes send."""
    return 2.0 * math.atan2(quaternion.z, quaternion.w)


def angle_between(first, second):
    return abs(wrap_angle(first - second))


def connected_publisher(topic, message_class, nodes=()):
    """A publisher that at least one subscriber, and each of the nodes, hears: nothing that it sends is lost."""
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', SyntaxWarning)
        # Without a queue `publish` returns when the message is in the socket: two publishers keep their order.
        publisher = rospy.Publisher(topic, message_class, queue_size=None, tcp_nodelay=True)

    def is_connected():
        listeners = dict(rosgraph.Master(rospy.get_name()).getSystemState()[1]).get(publisher.resolved_name, [])
        return set(nodes) <= set(listeners) and publisher.get_num_connections() >= max(len(listeners), 1)

    wait_until(is_connected, f'{nodes or "a subscriber"} at {topic}')
    return publisher


class Collector:
    """Keeps every message of a topic, from the moment that a publisher is connected."""

    def __init__(self, topic, message_class, wait_for_publisher=True):
        self.topic = topic
        self._messages = []
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, message_class, self._on_message, tcp_nodelay=True)
        if wait_for_publisher:
            wait_until(lambda: self.connections() > 0, 'a publisher of ' + topic)

    def connections(self):
        return self._subscriber.get_num_connections()

    def _on_message(self, message):
        with self._changed:
            self._messages.append(message)
            self._changed.notify_all()

    @property
    def messages(self):
        with self._changed:
            return list(self._messages)

    def clear(self):
        with self._changed:
            self._messages = []

    def stop(self):
        """Unsubscribe; what has come is kept."""
        self._subscriber.unregister()

    def wait_for(self, condition, what, timeout_s=TIMEOUT_S):
        """All messages, as soon as `condition(messages)` is true."""
        with self._changed:
            if not self._changed.wait_for(lambda: condition(self._messages), timeout_s):
                raise AssertionError(
                    f'{self.topic}: {len(self._messages)} messages, but not {what} in {timeout_s:.0f} s. '
                    f'The last one:\n{self._messages[-1:]}'
                )
            return list(self._messages)

    def wait_for_count(self, count, timeout_s=TIMEOUT_S):
        return self.wait_for(lambda messages: len(messages) >= count, f'{count} messages', timeout_s)

    def wait_for_stamp(self, stamp_ns, timeout_s=TIMEOUT_S):
        """All messages, as soon as one with this stamp has come."""
        return self.wait_for(
            lambda messages: any(stamp_ns_of(message) == stamp_ns for message in messages),
            'the stamp %.6f s' % (stamp_ns / NS_PER_S),
            timeout_s,
        )


class RosoutWatch:
    """The warnings (and worse) that nodes log."""

    def __init__(self):
        self._log = Collector('/rosout', Log)

        def are_all_connected():  # a node that we are not yet connected to could warn unheard
            publishers = dict(rosgraph.Master(rospy.get_name()).getSystemState()[0])
            return self._log.connections() >= len(publishers.get('/rosout', []))

        wait_until(are_all_connected, "every node's /rosout")

    def clear(self):
        self._log.clear()

    def lines_of(self, node, level=Log.DEBUG):
        return [entry.msg for entry in self._log.messages if entry.name == node and entry.level >= level]

    def warnings_of(self, node):
        return self.lines_of(node, Log.WARN)

    def wait_for_warning(self, node, *words):
        """The node's warnings, as soon as one of them has all the words."""
        wait_until(
            lambda: any(all(word in text for word in words) for text in self.warnings_of(node)),
            lambda: f'a warning of {node} with {words}; it warned of {self.warnings_of(node)}',
        )
        return self.warnings_of(node)


class NodeTest(unittest.TestCase):
    """Base of the test classes: gives each test a stretch of time of its own.

    The nodes live on from test to test, and a stamp that goes back means something to them.
    """

    _epoch_s = 1000

    def setUp(self):
        NodeTest._epoch_s += 1000
        self.epoch_ns = NodeTest._epoch_s * NS_PER_S
        self.rosout.clear()

    def assert_stamps(self, messages, expected_ns):
        self.assertEqual(
            [stamp_ns_of(message) - self.epoch_ns for message in messages],
            [stamp_ns - self.epoch_ns for stamp_ns in expected_ns],
        )

    def assert_warned_once(self, node, *words):
        warned = self.rosout.wait_for_warning(node, *words)
        self.assertEqual(len([text for text in warned if all(word in text for word in words)]), 1, warned)
