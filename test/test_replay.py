"""replay.launch: the live nodes report the counts and poses of reencode."""

import pytest

from diff_encoder_sim.cli import reencode
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.drives.trial_recording import read_trial
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from launched_graph import DATA, ROOT, Graph, complaints, messages_of, require_ros
from lockstep_trials import ALTO, plan_of, run_trial
from node_interfaces import REPLAY, check_interfaces
from reencoding_drives import drive, without_index, write_ros1

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(180)]

TOUR, RECORDED_PPR = DATA / 'short_tour.yaml', 90
SAME = ('/encoder_pulse', '/odom', '/tf', '/trial', '/trial_result', '/world_pose')


def record(path, bag_format):
    """A drive in lockstep, as a campaign records it in full."""
    plan = plan_of(TOUR, RECORDED_PPR, 3, nav='scripted', bag=path).model_copy(update={'bag_format': bag_format})
    run_trial(plan, ALTO, override(load_robot_config(ROOT / 'config'), {}), 'full')
    return path


def replay(folder, *arguments, compared=()):
    """Output of a replay."""
    with Graph(folder) as graph:
        launch = graph.launch(ROOT / 'launch' / 'replay.launch', *arguments)
        check_interfaces(graph, launch, compared)
        code = launch.wait()
        assert code == 0 and graph.is_gone(), launch.output()
        return launch.output()


def test_the_live_nodes_report_what_reencode_reports(tmp_path):
    require_ros()
    ros1, mcap = record(tmp_path / 'tour.bag', 'ros1'), record(tmp_path / 'tour.mcap', 'mcap')
    live = tmp_path / 'live.bag'
    output = replay(tmp_path / 'ros', f'bag:={mcap}', 'ppr:=1024', f'out:={live}', 'speed:=4', compared=REPLAY)
    assert complaints(output) == []
    reencode.main([str(ros1), '--ppr', '1024', str(RECORDED_PPR), '--out', str(tmp_path / 'out')])
    reencoded = (tmp_path / 'out' / f'tour_{ppr}ppr.bag' for ppr in (1024, 90))
    found, expected, as_recorded = (messages_of(path) for path in (live, *reencoded))
    assert set(found) == set(expected) == set(SAME)
    for topic in SAME:
        assert found[topic] == expected[topic], topic
    recording = read_trial(live)  # as analysis does
    assert (recording.trial.ppr.left, recording.outcome) == (1024, Outcome.SUCCEEDED)
    recorded = messages_of(ros1)
    for topic in set(SAME) - {'/tf'}:
        assert as_recorded[topic] == recorded[topic], topic
    assert set(as_recorded['/tf']) < set(recorded['/tf'])


def test_a_torn_bag_with_joints_of_other_names_on_another_topic(tmp_path):
    require_ros()
    rows = drive(count=201, joint_topic='/robot/joints', names=('robot_l', 'robot_r'), reference=None)
    content = without_index(write_ros1(tmp_path / 'whole.bag', rows).read_bytes())
    torn, live, ppr = tmp_path / 'torn.bag', tmp_path / 'live.bag', '{left: 90, right: 1024}'
    torn.write_bytes(content[:-5000])
    files, joints = (f'bag:={torn}', f'out:={live}'), ('left:=robot_l', 'right:=robot_r')
    output = replay(tmp_path / 'ros', *files, *joints, f'ppr:={ppr}', 'speed:=5')
    assert 'torn in the chunk' in output and 'all messages that can be read are played' in output
    names = ['--left', 'robot_l', '--right', 'robot_r']
    reencode.main([str(torn), '--ppr', ppr, *names, '--out', str(tmp_path / 'out')])
    found, expected = (messages_of(path) for path in (live, *(tmp_path / 'out').glob('*.bag')))
    assert found == expected and 30 < len(found['/encoder_pulse']) < 41
