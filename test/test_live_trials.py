"""A trial on the live graph and in lockstep: the same messages, byte for byte, in bags of one kind."""

import subprocess

import pytest
import yaml

from diff_encoder_sim.base.imu import imu_settings
from diff_encoder_sim.drives.topics import DIAGNOSTICS
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.link_frames import LinkFrames, display_urdf
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from launched_graph import DATA, ROOT, Graph, complaints, messages_of, require_ros
from lockstep_trials import ALTO, plan_of, run_trial
from node_interfaces import FUSED, check_interfaces

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(180)]

TOUR, NUMBER = DATA / 'short_tour.yaml', 3
USUAL = yaml.safe_load((ROOT / 'config' / 'config.yaml').read_text())
# Messages that do not depend on how long another message was on its way.
STAMPED = ('/joint_states', '/gazebo/model_states', '/scan', '/encoder_pulse', '/odom', '/world_pose')

# An encoder with an error of each stage, and reports that are late, repeated, out of order or lost. Its rate divides
# neither the simulator's nor the controllers': with fixed periods, time waited in vain for each report.
REAL_ENCODER = {
    **{key: value for key, value in USUAL.items() if key != 'ppr'},
    **yaml.safe_load((DATA / 'real_encoder.yaml').read_text()),
    'rate': 33.3,
    'counter_modulus': 65536,
    'report': dict(jitter=0.004, latency=0.03, latency_spread=0.01, lost=0.05, repeated=0.05, reordered=0.05),
    'velocity_low_pass': 0.05,
}
REAL_ENCODER['encoder']['faults'] = {'missed': 0.01, 'missed_burst': 3.0, 'extra': 0.002, 'restart_at': 4.0}


def drive_both_ways(folder, config, imu='none', fusion='none'):
    """Drives the tour live and in lockstep with these values of config.yaml; returns the bags (live, lockstep)."""
    require_ros()
    path, live, lockstep = (folder / name for name in ('config.yaml', 'live.bag', 'lockstep.bag'))
    path.write_text(yaml.safe_dump(config))
    with Graph(folder) as graph:
        files = f'test:={TOUR}', f'config:={path}', f'bag:={live}'
        trial = ROOT / 'launch' / 'trial.launch'
        of_imu = f'imu:={imu}', f'fusion:={fusion}'
        launch = graph.launch(trial, *files, 'nav:=scripted', 'rtf:=0', f'trial:={NUMBER}', *of_imu)
        if fusion != 'none':
            check_interfaces(graph, launch, FUSED)
        assert launch.wait() == 0, launch.output()
        assert graph.is_gone(), 'it left processes behind'
        # Each wait that ended without its message would be warned of.
        assert [line for line in complaints(launch.output()) if 'counter restart' not in line] == []
    simulated = imu_settings(imu, ROOT / 'config', ROOT)
    params = override(load_robot_config(ROOT / 'config', {'config': path}), simulated)
    ppr = params.encoder.counts_per_turn
    plan = plan_of(TOUR, ppr, NUMBER, nav='scripted', bag=lockstep)
    run_trial(plan.model_copy(update={'trial': plan.trial.model_copy(update={'fusion': fusion})}), ALTO, params, 'full')
    return live, lockstep


@pytest.fixture(scope='module')
def paths(tmp_path_factory):
    """(live, lockstep) with another ideal encoder on each wheel."""
    return drive_both_ways(tmp_path_factory.mktemp('both'), {**USUAL, 'ppr': {'left': 90, 'right': 1024}})


@pytest.fixture(scope='module')
def bags(paths):
    return [messages_of(path) for path in paths]


def assert_same_messages(bags, topics):
    for topic in topics:
        live, lockstep = (messages[topic] for messages in bags)
        # Simulated time goes on a little while the live graph ends.
        assert 0 <= len(live) - len(lockstep) < 0.1 * len(lockstep), topic
        assert live[: len(lockstep)] == lockstep, topic


def test_every_message_is_the_same_byte_for_byte(bags):
    assert_same_messages(bags, [*STAMPED, '/global_pose', '/cmd_vel', '/trial', '/trial_result'])
    live, lockstep = bags
    assert len(live['/trial']) == len(live['/trial_result']) == 1
    # While it is paused, the live simulator publishes 0 again and again.
    assert set(lockstep['/clock']) <= set(live['/clock'])
    kinds = [{topic: messages[0][::2] for topic, messages in bag.items() if topic != DIAGNOSTICS} for bag in bags]
    assert kinds[0] == kinds[1]


def test_an_encoder_and_an_imu_with_errors_report_the_same_live_and_so_does_their_fusion(tmp_path):
    bags = [messages_of(path) for path in drive_both_ways(tmp_path, REAL_ENCODER, 'mpu6050', 'embedded')]
    assert_same_messages(bags, [*STAMPED, '/encoder_velocity', '/imu/data', '/odometry/filtered'])
    for messages in bags:
        frames = [each.child_frame_id for _, content, _ in messages['/tf_static'] for each in transforms_of(content)]
        assert frames.count('imu_link') == 1
        moving = [each for _, content, _ in messages['/tf'] for each in transforms_of(content)]
        assert len([each for each in moving if each.child_frame_id == 'base_link']) == len(
            messages['/odometry/filtered']
        )
    assert len(bags[0]['/odom']) > 300


def test_the_bag_has_the_diagnostics_of_each_simulated_second(bags):
    from diagnostic_msgs.msg import DiagnosticArray

    messages = [DiagnosticArray().deserialize(content) for _, content, _ in bags[0][DIAGNOSTICS]]
    end_s = len(bags[0]['/odom']) / 20.0
    for name in ('gz_diff_encoder_node: Counts', 'gz_diff_odom_node: Odometry'):
        stamps = [message.header.stamp.to_sec() for message in messages if message.status[0].name == name]
        assert stamps[0] <= 0.05 and stamps[-1] > end_s - 1.1
        assert [later - earlier for earlier, later in zip(stamps, stamps[1:])] == pytest.approx([1.0] * len(stamps[1:]))


def test_frames_of_links_and_odometry_are_the_same(bags):
    """Of wheels at the times of robot_state_publisher, which depend on the host; KDL rounds the last bit."""
    from sensor_msgs.msg import JointState

    live, lockstep = ([each for _, content, _ in bag['/tf'] for each in transforms_of(content)] for bag in bags)
    states = [JointState().deserialize(content) for _, content, _ in bags[0]['/joint_states']]
    angles = {state.header.stamp.to_nsec(): dict(zip(state.name, state.position)) for state in states}
    frames = LinkFrames(display_urdf(RobotSource(ALTO), next(iter(angles.values()))))
    published = [transform for transform in live if transform.header.frame_id == 'base_link']
    assert len(published) > 50
    for transform in published:
        ours = {frame.child: frame for frame in frames.turned(angles[transform.header.stamp.to_nsec()])}
        frame = ours[transform.child_frame_id]
        assert numbers_of(transform) == pytest.approx([*frame.translation_xyz_m, *frame.quat_xyzw], abs=1e-15)
    live, lockstep = (
        {each.header.stamp.to_nsec(): numbers_of(each) for each in transforms if each.header.frame_id == 'odom'}
        for transforms in (live, lockstep)
    )
    assert len(lockstep) > 100
    assert {key: live[key] for key in lockstep} == lockstep
    live, lockstep = ([each for _, content, _ in bag['/tf_static'] for each in transforms_of(content)] for bag in bags)
    live, lockstep = ({each.child_frame_id: numbers_of(each) for each in static} for static in (live, lockstep))
    assert live.keys() == lockstep.keys() >= {'laser', 'odom'}
    for child, numbers in live.items():
        assert numbers == pytest.approx(lockstep[child], abs=1e-12), child


def transforms_of(content):
    from tf2_msgs.msg import TFMessage

    return TFMessage().deserialize(content).transforms


def numbers_of(transform):
    place, turn = transform.transform.translation, transform.transform.rotation
    return [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]


def test_both_have_the_same_definitions_with_nothing_to_migrate(paths):
    """Except gazebo_msgs, where it is not installed."""
    from rosbags.rosbag1 import Reader

    definitions = []
    for path in paths:
        with Reader(path) as bag:
            found = {each.topic: getattr(each.msgdef, 'data', each.msgdef) for each in bag.connections}
        definitions.append({topic: text for topic, text in found.items() if topic != DIAGNOSTICS})
        result = subprocess.run(['rosbag', 'check', str(path)], capture_output=True, text=True, check=False)
        assert (result.returncode, result.stderr) == (0, '')
        migrations = [line for line in result.stdout.splitlines() if line.startswith(' * From: ')]
        assert [line for line in migrations if 'gazebo_msgs/ModelStates' not in line] == []
        assert migrations or 'does not need any migrations' in result.stdout
    assert definitions[0] == definitions[1]
