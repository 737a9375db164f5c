"""What a trial in lockstep records: the live graph's topics, each by its node, and nothing that is not recorded."""

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.navigator_inputs import Command, GoalStatus
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.publications import Publications, StatePublisher
from lockstep_trials import ALTO, params_of


class Bag:
    """Keeps (topic, node, content, time [ns])."""

    def __init__(self):
        self.written = []

    def publish(self, topic, node, time_ns, encode, *values):
        self.written.append((topic, node, encode(*values), time_ns))


def publications():
    bag = Bag()
    return bag, Publications(bag, params_of(), 'embedded')


def test_commands_are_by_the_node_that_sent_them():
    bag, recorded = publications()
    recorded.command(10, Command(0.1, 0.0), True)
    recorded.command(20, Command(0.0, 1.0), False)
    assert [(node, now_ns) for _, node, _, now_ns in bag.written] == [
        ('/move_base', 10),
        ('/navigation_trial_node', 20),
    ]


def test_goals_are_numbered_and_a_result_is_of_the_newest():
    bag, recorded = publications()
    for time_ns in (10, 20):
        recorded.goal(time_ns, time_ns, Pose2D(1.0, 2.0, 0.0))
    recorded.goal_result(30, GoalStatus.SUCCEEDED, 'there')
    *goals, result = [content for _, _, content, _ in bag.written]
    for number, content in zip((1, 2), goals):
        assert b'/navigation_trial_node-%d-' % number in content
    assert b'/navigation_trial_node-2-' in result and b'there' in result


MS = 1_000_000


def test_the_wheels_come_at_50_hz_from_20_ms_on_and_the_fixed_frames_once():
    written = []
    joints = 'left_wheel_joint', 'right_wheel_joint'

    class Bag:
        def publish(self, topic, node, time_ns, encode, *values):
            written.append((topic, time_ns, encode(*values)))

    publisher = StatePublisher(ALTO, joints, Bag())
    for now_ns in range(0, 110 * MS, 10 * MS):
        publisher.take(JointStates(now_ns, joints, (0.1, 0.2), (0.0, 0.0)))
    times = {topic: [now_ns // MS for each, now_ns, _ in written if each == topic] for topic in ('/tf', '/tf_static')}
    assert times == {'/tf': [20, 40, 60, 80, 100], '/tf_static': [20]}
    fixed = next(content for topic, _, content in written if topic == '/tf_static')
    wheels = next(content for topic, _, content in written if topic == '/tf')
    assert b'laser' in fixed and b'left_wheel' not in fixed
    assert b'left_wheel' in wheels and b'laser' not in wheels
