"""A trial on the live graph and in lockstep: the same messages, byte for byte, in bags of one kind."""

import subprocess

import pytest
import yaml

from diff_encoder_sim.drives.test_definition import find_world, load_test
from diff_encoder_sim.drives.topics import DIAGNOSTICS
from diff_encoder_sim.drives.trial_definition import Trial, TrialPlan
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import display_urdf
from diff_encoder_sim.simulation.link_frames import LinkFrames
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from diff_encoder_sim.trials.trial_run import run_trial
from launched_graph import DATA, ROOT, Graph, complaints, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(180)]

TOUR, NUMBER = DATA / 'short_tour.yaml', 3
# What does not depend on how long a message was on its way.
STAMPED = ('/joint_states', '/gazebo/model_states', '/scan', '/encoder_pulse', '/odom', '/world_pose', '/global_pose')
ONCE = ('/trial', '/trial_result')

# An encoder with an error of each stage, and reports that come late, twice, out of order or not at all.
REAL_ENCODER = {
    'rate': 50.0,
    'counter_modulus': 65536,
    'encoder': {
        'lines': 12,
        'side': 'motor',
        'gear_ratio': 34.014,
        'backlash': 0.01,
        'edge_error': 0.1,
        'phase_error': 10.0,
        'eccentricity': 0.02,
        'hysteresis': 0.3,
        'faults': {'missed': 0.01, 'missed_burst': 3.0, 'extra': 0.002, 'restart_at': 4.0},
    },
    'report': {
        'jitter': 0.004,
        'latency': 0.03,
        'latency_spread': 0.01,
        'lost': 0.05,
        'repeated': 0.05,
        'reordered': 0.05,
    },
    'velocity_method': 'MT',
    'velocity_low_pass': 0.05,
}


def drive_both_ways(folder, config):
    """Drives the tour live and in lockstep with a file in place of config.yaml; returns the bags (live, lockstep)."""
    require_ros()
    params = override(load_robot_config(ROOT / 'config', {'config': config}), {})
    with Graph(folder) as graph:
        launch = graph.launch(
            ROOT / 'launch' / 'trial.launch',
            f'test:={TOUR}',
            'nav:=scripted',
            'rtf:=0',
            f'trial:={NUMBER}',
            f'config:={config}',
            'bag:=%s' % (folder / 'live.bag'),
        )
        assert launch.wait() == 0, launch.output()
        assert [line for line in complaints(launch.output()) if 'counter restart' not in line] == []
    test = load_test(str(TOUR), ROOT / 'config')
    world = find_world(test.world, ROOT / 'worlds')
    run_trial(
        TrialPlan(
            trial=Trial(test=test, ppr=params.encoder.counts_per_turn, number=NUMBER, nav='scripted'),
            world=str(world),
            map=str(world.with_suffix('.yaml')),
            bag=str(folder / 'lockstep.bag'),
        ),
        ROOT / 'urdf' / 'alto.urdf.xacro',
        params,
        'full',
    )
    return [folder / name for name in ('live.bag', 'lockstep.bag')]


@pytest.fixture(scope='module')
def paths(tmp_path_factory):
    """(live, lockstep)"""
    return drive_both_ways(tmp_path_factory.mktemp('both'), ROOT / 'config' / 'config.yaml')


@pytest.fixture(scope='module')
def bags(paths):
    """(live, lockstep): raw messages by topic, each (type, bytes, md5sum)."""
    return [messages_of(path) for path in paths]


def messages_of(path):
    """Without diagnostics, which only live nodes publish."""
    import rosbag

    messages = {}
    for topic, (kind, content, md5sum, *_), _ in rosbag.Bag(str(path)).read_messages(raw=True):
        if topic != DIAGNOSTICS:
            messages.setdefault(topic, []).append((kind, content, md5sum))
    return messages


@pytest.mark.parametrize('topic', STAMPED)
def test_every_message_is_the_same_byte_for_byte(bags, topic):
    live, lockstep = (messages[topic] for messages in bags)
    # Simulated time goes on a little while the live graph ends.
    assert 0 <= len(live) - len(lockstep) < 0.1 * len(lockstep)
    assert live[: len(lockstep)] == lockstep


@pytest.fixture(scope='module')
def bags_of_real_encoder(tmp_path_factory):
    """(live, lockstep) with the same errors, drawn from the trial's number: messages as `bags`."""
    folder = tmp_path_factory.mktemp('real')
    usual = yaml.safe_load((ROOT / 'config' / 'config.yaml').read_text())
    del usual['ppr']  # the encoder says its own
    (folder / 'real.yaml').write_text(yaml.safe_dump({**usual, **REAL_ENCODER}))
    return [messages_of(path) for path in drive_both_ways(folder, folder / 'real.yaml')]


@pytest.mark.parametrize('topic', ['/joint_states', '/encoder_pulse', '/encoder_velocity', '/odom', '/world_pose'])
def test_an_encoder_with_errors_reports_the_same_live(bags_of_real_encoder, topic):
    live, lockstep = (messages[topic] for messages in bags_of_real_encoder)
    assert 0 <= len(live) - len(lockstep) < 0.1 * len(lockstep)
    assert live[: len(lockstep)] == lockstep


@pytest.mark.parametrize('topic', ONCE)
def test_what_is_published_once_is_the_same(bags, topic):
    live, lockstep = (messages[topic] for messages in bags)
    assert live == lockstep and len(live) == 1


def test_both_have_the_same_topics_of_the_same_types(bags):
    live, lockstep = ({topic: messages[0][::2] for topic, messages in bag.items()} for bag in bags)
    assert live == lockstep


def test_commands_and_clock_are_the_same_in_order(bags):
    live, lockstep = bags
    assert live['/cmd_vel'][: len(lockstep['/cmd_vel'])] == lockstep['/cmd_vel']
    # While it is paused, the live simulator publishes 0 again and again.
    assert set(lockstep['/clock']) <= set(live['/clock'])


def test_the_wheels_frames_are_those_that_robot_state_publisher_publishes(bags):
    """At its times, which depend on the load of the host; KDL rounds differently in the last bit."""
    from sensor_msgs.msg import JointState

    live, _ = bags
    states = [JointState().deserialize(content) for _, content, _ in live['/joint_states']]
    angles = {state.header.stamp.to_nsec(): dict(zip(state.name, state.position)) for state in states}
    frames = LinkFrames(display_urdf(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro'), next(iter(angles.values()))))
    published = [
        transform
        for _, content, _ in live['/tf']
        for transform in transforms_of(content)
        if transform.header.frame_id == 'base_link'
    ]
    assert len(published) > 50
    for transform in published:
        (ours,) = [
            frame
            for frame in frames.turned(angles[transform.header.stamp.to_nsec()])
            if frame.child == transform.child_frame_id
        ]
        assert numbers_of(transform) == pytest.approx([*ours.translation_xyz_m, *ours.quat_xyzw], abs=1e-15)


def test_the_fixed_frames_and_odometrys_are_the_same(bags):
    live, lockstep = (
        {
            (transform.header.stamp.to_nsec(), transform.child_frame_id): numbers_of(transform)
            for _, content, _ in bag['/tf']
            for transform in transforms_of(content)
            if transform.header.frame_id == 'odom'
        }
        for bag in bags
    )
    assert len(lockstep) > 100
    assert {key: live[key] for key in lockstep} == lockstep
    live, lockstep = (
        {
            transform.child_frame_id: numbers_of(transform)
            for _, content, _ in bag['/tf_static']
            for transform in transforms_of(content)
        }
        for bag in bags
    )
    assert live.keys() == lockstep.keys() >= {'laser', 'odom'}
    for child, numbers in live.items():
        assert numbers == pytest.approx(lockstep[child], abs=1e-12), child


def transforms_of(content):
    from tf2_msgs.msg import TFMessage

    return TFMessage().deserialize(content).transforms


def numbers_of(transform):
    place, turn = transform.transform.translation, transform.transform.rotation
    return [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]


def test_both_have_the_same_definitions(paths):
    from rosbags.rosbag1 import Reader

    def definitions(path):
        with Reader(path) as bag:
            return {
                connection.topic: getattr(connection.msgdef, 'data', connection.msgdef)
                for connection in bag.connections
                if connection.topic != DIAGNOSTICS
            }

    live, lockstep = (definitions(path) for path in paths)
    assert live == lockstep


def test_rosbag_check_finds_nothing_to_migrate(paths):
    """But gazebo_msgs, where it is not installed."""
    for path in paths:
        result = subprocess.run(['rosbag', 'check', str(path)], capture_output=True, text=True, check=False)
        assert (result.returncode, result.stderr) == (0, '')
        migrations = [line for line in result.stdout.splitlines() if line.startswith(' * From: ')]
        assert [line for line in migrations if 'gazebo_msgs/ModelStates' not in line] == []
        assert migrations or 'does not need any migrations' in result.stdout
