"""One round of live_messages.py, as a node: odd messages by a seed, then whether every node still responds."""

import math
import random
import signal
import sys
import time
import warnings

import rosgraph
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Pose, PoseStamped, PoseWithCovarianceStamped, TransformStamped, Twist
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import OccupancyGrid, Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.ros.gazebo_states import ModelStates
from diff_encoder_sim.ros.graph import node_api

NUMBERS = [0.0, -0.0, 1.0, -1.0, math.pi, 1e-320, 1e9, 1e18, 1e300, -1e308, math.nan, math.inf, -math.inf]
NAMES = ['', '/', 'map', 'odom', 'base_link', 'laser', 'left_wheel_joint', 'alto', 'a' * 5000, 'ä\0b', '//x y']
TOPICS = {
    '/joint_states': JointState,
    '/encoder_pulse': EncoderPulse,
    '/odom': Odometry,
    '/scan': LaserScan,
    '/tf': TFMessage,
    '/tf_static': TFMessage,
    '/cmd_vel': Twist,
    '/world_pose': PoseStamped,
    '/global_pose': PoseStamped,
    '/initialpose': PoseWithCovarianceStamped,
    '/map': OccupancyGrid,
    '/gazebo/model_states': ModelStates,
    '/move_base_simple/goal': PoseStamped,
    '/move_base/goal': MoveBaseActionGoal,
    '/move_base/cancel': GoalID,
    '/clock': Clock,
}
MANY = ('/joint_states', '/encoder_pulse', '/odom', '/tf', '/cmd_vel', '/world_pose', '/global_pose')
LIMIT_S = 60.0
ROUND_LIMIT_S = 110


def odd_stamp(rng):
    now_s = rospy.Time.now().to_sec()
    seconds = rng.choice([0, now_s, now_s + 0.05, now_s + 5, now_s + 50, now_s - 50, 2**31 - 1, 2**31, 2**32 - 1])
    return rospy.Time(int(max(seconds, 0)), rng.randrange(10**9))


# By the type of a field; floats of 32 bits hold less.
ODD = {
    'time': odd_stamp,
    'string': lambda rng: rng.choice(NAMES),
    'string[]': lambda rng: rng.sample(NAMES, rng.randrange(4)),
    'float32': lambda rng: rng.choice(NUMBERS[:7] + NUMBERS[-3:]),
    'float64': lambda rng: rng.choice(NUMBERS),
    'float32[]': lambda rng: rng.choices(NUMBERS[:7] + NUMBERS[-3:], k=rng.choice([0, 1, 2, 360])),
    'float64[]': lambda rng: rng.choices(NUMBERS, k=rng.choice([0, 1, 2, 3])),
    'int64[]': lambda rng: rng.choices([0, 7, -(2**63), 2**63 - 1], k=rng.choice([0, 2, 2, 2, 3])),
    'int8[]': lambda rng: rng.choices([0, 100, -1, -128, 127], k=rng.choice([0, 1, 100])),
    'uint32': lambda rng: rng.choice([0, 1, 10, 2**31 - 1]),
    'geometry_msgs/TransformStamped[]': lambda rng: [fill(TransformStamped(), rng) for _ in range(rng.randrange(1, 4))],
    'geometry_msgs/Pose[]': lambda rng: [fill(Pose(), rng) for _ in range(rng.randrange(3))],
    'geometry_msgs/Twist[]': lambda rng: [fill(Twist(), rng) for _ in range(rng.randrange(3))],
}


def fill(message, rng):
    """Set every field of a message to something odd."""
    if isinstance(message, TransformStamped) and rng.random() < 0.5:  # one that tf2 would take
        message.header.frame_id, message.child_frame_id = rng.choice([('odom', 'base_link'), ('map', 'odom')])
        message.header.stamp, message.transform.rotation.w = odd_stamp(rng), 1.0
        return message
    for name, kind in zip(message.__slots__, message._slot_types):
        value = getattr(message, name)
        if hasattr(value, '_slot_types'):
            fill(value, rng)
        elif kind == 'float64[36]':
            setattr(message, name, rng.choices(NUMBERS, k=36))
        elif kind in ODD:
            setattr(message, name, ODD[kind](rng))
    return message


def send(topic, rng):
    message_class = TOPICS[topic]
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', SyntaxWarning)
        publisher = rospy.Publisher(topic, message_class, queue_size=None, tcp_nodelay=True)
    deadline = time.monotonic() + 5.0
    while not publisher.get_num_connections() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.3)
    pool = [fill(message_class(), rng) for _ in range(20)]
    count = rng.choice([1, 100, 10000]) if topic in MANY else rng.choice([1, 10, 100])
    for _ in range(count):
        publisher.publish(rng.choice(pool))
    publisher.unregister()
    print(f'sent {count} {topic}')


def nodes_that_do_not_respond():
    master = rosgraph.Master(rospy.get_name())
    silent = []
    for node in sorted({node for _, nodes in master.getSystemState()[0] for node in nodes} - {rospy.get_name()}):
        try:
            node_api(master.lookupNode(node), LIMIT_S).getPid(rospy.get_name())
        except TimeoutError:
            silent.append(node)
        except (OSError, rosgraph.MasterException):
            continue  # live_messages.py sees what has died
    return silent


def main():
    signal.alarm(ROUND_LIMIT_S)  # without a master, which ends with the trial, a publisher waits for ever
    rng = random.Random(int(sys.argv[1]))
    rospy.init_node('live_sender', anonymous=True, log_level=rospy.FATAL)
    for topic in rng.sample(sorted(TOPICS), 3):
        send(topic, rng)
    silent = nodes_that_do_not_respond()
    if silent:
        sys.exit(f'no response from {", ".join(silent)} for {LIMIT_S:g} s')


if __name__ == '__main__':
    main()
