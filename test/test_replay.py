"""replay.launch: the live nodes say what reencode says, pulse for pulse; and what it refuses."""

from pathlib import Path

import pytest

from diff_encoder_sim.cli import reencode
from diff_encoder_sim.drives.bag_files import SUFFIXES
from diff_encoder_sim.drives.test_definition import find_world, load_test
from diff_encoder_sim.drives.trial_definition import Outcome, Trial, TrialPlan
from diff_encoder_sim.drives.trial_recording import read_trial
from diff_encoder_sim.trials.robot_params import load_robot_params
from diff_encoder_sim.trials.trial_run import run_trial
from launched_graph import DATA, ROOT, Graph, complaints, require_ros
from reencoding_drives import drive, without_index, write_ros1

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(180)]

REPLAY = ROOT / 'launch' / 'replay.launch'
TOUR, RECORDED_PPR = DATA / 'short_tour.yaml', 90
SAME = ('/encoder_pulse', '/odom', '/tf', '/trial', '/trial_result', '/world_pose')


@pytest.fixture(scope='module')
def trial_bags(tmp_path_factory):
    """A drive in lockstep, as a campaign records it in full, by format."""
    folder = tmp_path_factory.mktemp('trial')
    test = load_test(str(TOUR), ROOT / 'config')
    world = find_world(test.world, ROOT / 'worlds')
    ppr = {'left': RECORDED_PPR, 'right': RECORDED_PPR}
    plans = {
        bag_format: TrialPlan(
            trial=Trial(test=test, ppr=ppr, number=3, nav='scripted'),
            world=str(world),
            map=str(world.with_suffix('.yaml')),
            bag=str(folder / f'tour{suffix}'),
            bag_format=bag_format,
        )
        for bag_format, suffix in SUFFIXES.items()
    }
    for plan in plans.values():
        run_trial(plan, ROOT / 'urdf' / 'alto.urdf.xacro', load_robot_params(ROOT / 'config'), 'full')
    return {bag_format: Path(plan.bag) for bag_format, plan in plans.items()}


@pytest.fixture
def trial_bag(trial_bags):
    return trial_bags['ros1']


def messages_of(path):
    import rosbag

    messages = {}
    with rosbag.Bag(str(path)) as bag:
        for topic, (kind, content, md5sum, *_), _ in bag.read_messages(raw=True):
            messages.setdefault(topic, []).append((kind, content, md5sum))
    return messages


def replay(folder, *arguments):
    """(exit code, output)"""
    with Graph(folder) as graph:
        launch = graph.launch(REPLAY, *arguments)
        code = launch.wait()
        assert graph.is_gone(10.0), 'it left processes behind'
        return code, launch.output()


@pytest.mark.parametrize(('bag_format', 'ppr', 'speed'), [('mcap', 1024, 5)])
def test_the_live_nodes_say_what_reencode_says(tmp_path, trial_bags, bag_format, ppr, speed):
    require_ros()
    live, trial_bag = tmp_path / 'live.bag', trial_bags['ros1']
    code, output = replay(
        tmp_path / 'ros', f'bag:={trial_bags[bag_format]}', f'ppr:={ppr}', f'out:={live}', f'speed:={speed}'
    )
    assert code == 0 and complaints(output) == [], output
    reencode.main([str(trial_bag), '--ppr', str(ppr), '--out', str(tmp_path / 'out')])
    found, expected = (messages_of(path) for path in (live, tmp_path / 'out' / (f'tour_{ppr}ppr.bag')))
    assert set(found) == set(expected) == set(SAME)
    for topic in SAME:
        assert found[topic] == expected[topic], topic
    recording = read_trial(live)  # as analysis does
    assert (recording.trial.ppr.left, recording.outcome) == (ppr, Outcome.SUCCEEDED)


def test_the_recorded_ppr_gives_what_was_recorded(tmp_path, trial_bag):
    require_ros()
    reencode.main([str(trial_bag), '--ppr', str(RECORDED_PPR), '--out', str(tmp_path)])
    found, recorded = (messages_of(path) for path in (tmp_path / 'tour_90ppr.bag', trial_bag))
    for topic in ('/encoder_pulse', '/odom', '/trial', '/trial_result', '/world_pose'):
        assert found[topic] == recorded[topic], topic
    assert set(found['/tf']) < set(recorded['/tf'])


def test_joints_of_other_names_on_another_topic(tmp_path):
    require_ros()
    names = ('robot_l', 'robot_r')
    bag = write_ros1(tmp_path / 'a.bag', drive(count=201, joint_topic='/robot/joints', names=names, reference=None))
    code, output = replay(
        tmp_path / 'ros',
        f'bag:={bag}',
        'out:=%s' % (tmp_path / 'live.bag'),
        'left:=robot_l',
        'right:=robot_r',
        'ppr:={left: 90, right: 1024}',
    )
    assert code == 0, output
    reencode.main(
        [
            str(bag),
            '--ppr',
            '{left: 90, right: 1024}',
            '--left',
            'robot_l',
            '--right',
            'robot_r',
            '--out',
            str(tmp_path / 'out'),
        ]
    )
    found, expected = (messages_of(path) for path in (tmp_path / 'live.bag', *(tmp_path / 'out').glob('*.bag')))
    assert found == expected and len(found['/encoder_pulse']) == 41


def test_a_bag_without_index_is_played_as_far_as_it_goes(tmp_path):
    require_ros()
    rows = drive(count=201, reference=None)
    content = without_index(write_ros1(tmp_path / 'whole.bag', rows).read_bytes())
    (tmp_path / 'torn.bag').write_bytes(content[:-5000])
    code, output = replay(
        tmp_path / 'ros', 'bag:=%s' % (tmp_path / 'torn.bag'), 'out:=%s' % (tmp_path / 'live.bag'), 'speed:=5'
    )
    assert code == 0 and 'torn in the chunk' in output and 'all messages that can be read are played' in output
    assert 30 < len(messages_of(tmp_path / 'live.bag')['/encoder_pulse']) < 41


@pytest.mark.parametrize(
    ('name', 'write', 'rows', 'arguments', 'texts'),
    [('a.bag', write_ros1, drive(names=('a', 'b')), [], ["'left_wheel_joint'", 'a, b'])],
)
def test_what_cannot_be_replayed_is_named_in_one_line(tmp_path, name, write, rows, arguments, texts):
    require_ros()
    write(tmp_path / name, rows)
    out = 'out:=%s' % (tmp_path / 'live.bag')
    code, output = replay(
        tmp_path / 'ros', f'bag:={tmp_path / name}', *(arguments if 'out' in ''.join(arguments) else [out, *arguments])
    )
    lines = [line for line in output.splitlines() if 'FATAL' in line]
    assert code != 0 and len(lines) == 1, output
    for text in texts:
        assert text in lines[0]
    assert not (tmp_path / 'live.bag').exists()
