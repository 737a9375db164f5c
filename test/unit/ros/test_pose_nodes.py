"""What global_pose_node does when transforms come at once; the rest is in test/rostest/poses_test.py."""

import threading

import genpy
from geometry_msgs.msg import TransformStamped

from diff_encoder_sim.drives.message_decoders import encoded_stamp_ns
from diff_encoder_sim.ros.pose_nodes import GlobalPoseNode, GlobalPoseParams

PERIOD_NS = 50_000_000


class GrowingBuffer:
    """Holds a later transform at each look, and lets another thread look before it answers."""

    def __init__(self):
        self.looks, self._lock, self._meeting = 0, threading.Lock(), threading.Barrier(2)

    def lookup_transform(self, *_):
        with self._lock:
            self.looks += 1
            newest = TransformStamped()
            newest.header.stamp = genpy.Time(0, self.looks * PERIOD_NS)
            is_first = self.looks % 2 == 1
        try:
            self._meeting.wait(0.01)
        except threading.BrokenBarrierError:
            self._meeting.reset()
        if is_first:
            threading.Event().wait(0.001)
        return newest


def test_transforms_of_two_publishers_give_no_pose_twice_or_out_of_order():
    """Each connection calls back in a thread of its own: an older look must not be published after a newer one."""
    node, published = object.__new__(GlobalPoseNode), []
    node._params, node._buffer, node._lock = GlobalPoseParams(), GrowingBuffer(), threading.Lock()
    node._restart()
    node._poses = type('Publisher', (), {'publish': lambda _, content: published.append(encoded_stamp_ns(content))})()
    for _ in range(5):
        threads = [threading.Thread(target=node._publish) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert published == [look * PERIOD_NS for look in range(1, 11)]
