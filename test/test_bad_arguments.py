"""A user's mistake stops a node, or a trial, with one line that names it: what was given, what is allowed."""

import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from launched_graph import DATA, ROOT, Graph, require_ros
from reencoding_drives import drive, write_ros1

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(200)]

SCRIPTS = ROOT / 'scripts'
TRIAL = ROOT / 'launch' / 'trial.launch'
WORLD = '_world:=%s' % (ROOT / 'worlds' / 'hallway.world')
ROBOT = '_robot:=%s' % (ROOT / 'urdf' / 'alto.urdf.xacro')
ENCODER, SIMULATOR = 'gz_diff_encoder_node', 'simulator_node'
PPR_ALLOWED = '0.001 to 1e9 [per revolution]'

FILES = {
    'torn.yaml': 'image: torn.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n',
    'torn.pgm': 'P5 100 100 255\n',
    'exists.bag': 'a bag of somebody',
}

# Node, its private parameters, words of its line; {} is the folder of FILES.
BAD_PARAMETERS = {
    'ppr_zero': (ENCODER, ['_ppr:=0'], ['ppr', '0', PPR_ALLOWED]),
    'misspelt': (ENCODER, ['_counter_modulos:=65536'], ['counter_modulos', 'counter_modulus']),
    'empty_frame': ('global_pose_node', ["_map_frame:=''"], ['map_frame', "''"]),
    'no_trial': ('scripted_drive_node', [], ['/trial', 'trial.launch']),
    'missing_world': (SIMULATOR, [ROBOT, '_world:={}/nowhere.world'], ['nowhere.world', 'No such file']),
    'misspelt_joint': (
        SIMULATOR,
        [WORLD, ROBOT, '_left_joint:=left_weel_joint'],
        ['left_weel_joint', "did you mean 'left_wheel_joint'"],
    ),
    'scan_rate': (SIMULATOR, [WORLD, ROBOT, '_lidar:={rate: 30}'], ['lidar', "'rate': 30", 'whole 10 ms']),
    'map_cut_off': ('map_server_node', ['{}/torn.yaml'], ['torn.pgm', 'truncated']),
    'joints': ('replay_node', ['_bag:={}/a.bag', '_out:={}/live.bag'], ["'left_wheel_joint'", 'a, b']),
    'no_map': ('map_server_node', [], ['arguments', 'one map .yaml file']),
}

# Arguments of trial.launch, words of one line; more: test/unit/api/test_api_live_trials.py.
BAD_ARGUMENTS = {
    'test': (['test:=XX'], ['test', 'XX', 'SL', 'SMT']),
    'bag': (['bag:={}/exists.bag'], ['bag', 'exists.bag', 'exists', 'new file']),
    'robot': (['robot:={}/nobody.urdf', 'bag:=none'], ['nobody.urdf', 'but there is no']),
}


@pytest.fixture(scope='module')
def outcomes(tmp_path_factory):
    """What each bad start ended with. They run side by side, as starting is all that they do."""
    require_ros()
    folder = tmp_path_factory.mktemp('bad_arguments')
    for name, text in FILES.items():
        (folder / name).write_text(text)
    write_ros1(folder / 'a.bag', drive(names=('a', 'b')))
    with Graph(folder / 'ros') as graph, ThreadPoolExecutor(2) as pool:
        graph.start_master()
        runs = {}
        for name, (node, parameters, _) in BAD_PARAMETERS.items():
            # a name of its own, as parameters outlive the node
            command = [sys.executable, SCRIPTS / node, f'__name:={name}', *parameters]
            runs[name] = pool.submit(run_and_read, graph, folder, command)
        for name, (arguments, _) in BAD_ARGUMENTS.items():
            runs[name] = pool.submit(run_and_read, graph, folder, ['roslaunch', TRIAL, *arguments])
        yield {key: run.result() for key, run in runs.items()}


def run_and_read(graph, folder, command):
    """(exit code or None when it had to be ended, lines of output)"""
    process = graph.start(*(str(word).replace('{}', str(folder)) for word in command))
    try:
        code = process.wait(20.0)
    except pytest.fail.Exception:
        process.send_signal(9)
        code = None
    return code, [line for line in process.output().splitlines() if line.strip() and 'pybullet build time' not in line]


@pytest.mark.parametrize('name', list(BAD_PARAMETERS))
def test_node_names_the_bad_parameter_in_one_line(name, outcomes):
    code, lines = outcomes[name]
    assert (code, len(lines)) == (1, 1), lines
    for word in BAD_PARAMETERS[name][2]:
        assert word in lines[0]


@pytest.mark.parametrize('name', list(BAD_ARGUMENTS))
def test_trial_names_the_bad_argument_in_one_line(name, outcomes):
    code, lines = outcomes[name]
    shown = '\n'.join(lines)
    assert code == 1 and 'Traceback (most recent call last)' not in shown, shown
    assert any(all(word in line for word in BAD_ARGUMENTS[name][1]) for line in lines), shown
    assert 'process[simulator_node' not in shown  # nothing was started


def test_trial_ends_when_a_node_refuses_its_parameters(tmp_path):
    """Not every argument is checked before: the launch must fail with the node."""
    require_ros()
    with Graph(tmp_path / 'ros') as graph:
        launch = graph.launch(TRIAL, 'test:=%s' % (DATA / 'short_line.yaml'), 'nav:=scripted', 'rtf:=-1', 'bag:=none')
        assert launch.wait() != 0
        naming = [line for line in launch.output().splitlines() if 'FATAL' in line]
        assert len(naming) == 1
        assert 'real_time_factor: given -1' in naming[0]
        assert graph.is_gone(10.0)
