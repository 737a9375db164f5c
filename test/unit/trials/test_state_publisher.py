"""The frames that robot_state_publisher would publish, at its rate."""

from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.publications import StatePublisher
from lockstep_trials import ALTO

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
