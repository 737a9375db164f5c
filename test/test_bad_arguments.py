"""A user's mistake stops a node, or a trial, with one line that names it: what was given, what is allowed."""

import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.trial_spec import main as trial_spec_main
from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.simulated_robot import load_simulated_robot
from launched_graph import DATA, ROOT, Graph, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(200)]

SCRIPTS = ROOT / 'scripts'
TRIAL = ROOT / 'launch' / 'trial.launch'
WORLD = '_world:=%s' % (ROOT / 'worlds' / 'hallway.world')
ROBOT = '_robot:=%s' % (ROOT / 'urdf' / 'alto.urdf.xacro')
ENCODER, ODOM, SIMULATOR = 'gz_diff_encoder_node', 'gz_diff_odom_node', 'simulator_node'
PPR_ALLOWED = '0.001 to 1e9 [per revolution]'
AWAIT_MASTER = 'import rosgraph, time\nwhile not rosgraph.is_master_online(): time.sleep(0.05)'

ROBOT_FILE = """<robot name="box">
  <link name="base_link">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="left"><collision><geometry><sphere {radius}/></geometry></collision></link>
  <link name="right"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="left_wheel_joint" type="continuous"><parent link="base_link"/><child link="left"/>
    <origin {origin}/><axis xyz="0 1 0"/></joint>
  <joint name="right_wheel_joint" type="continuous"><parent link="base_link"/><child link="right"/>
    <origin xyz="0 -0.2 0"/><axis xyz="0 1 0"/></joint>
</robot>
"""

# What is wrong: the left wheel's radius and origin in ROBOT_FILE, words of the error
BAD_ROBOTS = {
    'radius is text': ('radius="thick"', 'xyz="0 0.2 0"', ['thick']),
    'radius is negative': ('radius="-0.1"', 'xyz="0 0.2 0"', ['-0.1']),
    'radius is not finite': ('radius="nan"', 'xyz="0 0.2 0"', ['nan']),
    'radius is missing': ('', 'xyz="0 0.2 0"', ['radius']),
    'origin is text': ('radius="0.1"', 'xyz="0 left 0"', ['0 left 0']),
    'origin is short': ('radius="0.1"', 'xyz="0 0.2"', ['0 0.2']),
    'origin is not finite': ('radius="0.1"', 'xyz="0 inf 0"', ['inf']),
    'rotation is text': ('radius="0.1"', 'xyz="0 0.2 0" rpy="0 up 0"', ['0 up 0']),
    'wheels are swapped': ('radius="0.1"', 'xyz="0 -0.5 0"', ['left_wheel_joint', '-0.5']),
}

FILES = {
    'torn.world': '<sdf version="1.6"><world name="torn">',
    'no_floor.world': '<sdf version="1.6"><world name="bare"/></sdf>',
    'mesh.world': '<sdf version="1.6"><world name="w"><model name="m"><static>1</static><link name="l">'
    '<collision name="c"><geometry><mesh><uri>a.dae</uri></mesh></geometry></collision></link></model></world></sdf>',
    'torn.urdf': '<robot name="torn"><link',
    'no_yaml.yaml': 'ppr: [90\nrate: 20\n',
    'list.yaml': '- ppr\n- 90\n',
    'misspelt.yaml': 'wheel_diametre: 0.2\n',
    'twice.yaml': 'rate: 20.0\nrate: 10.0\n',
    'minutes.yaml': 'map_update_interval: 1:30\n',
    'negative.yaml': 'wheel_diameter: -0.2\n',
    'no_such_world.yaml': 'name: t\nworld: moon\ndrive: [{straight: 1.0}]\n',
    'two_motions.yaml': 'name: t\nworld: hallway\ndrive: [{straight: 1.0, turns: 1}]\n',
    'no_route.yaml': 'name: t\nworld: hallway\ndrive: [{straight: 1.0}]\n',
    'no_drive.yaml': 'name: t\nworld: hallway\ndrive: []\n',
    'exists.bag': 'a bag of somebody',
}

# What is wrong: node, its private parameters, words of its line ({} is the folder of FILES)
BAD_PARAMETERS = {
    'ppr zero': (ENCODER, ['_ppr:=0'], ['ppr', '0', PPR_ALLOWED]),
    'ppr negative': (ENCODER, ['_ppr:=-1'], ['ppr', '-1', PPR_ALLOWED]),
    'ppr nan': (ODOM, ['_ppr:=.nan'], ['ppr', 'nan', PPR_ALLOWED]),
    'ppr infinite': (ODOM, ['_ppr:=.inf'], ['ppr', 'inf', PPR_ALLOWED]),
    'ppr text': (ENCODER, ['_ppr:=ninety'], ['ppr', 'ninety', PPR_ALLOWED]),
    'ppr of one wheel': (ENCODER, ['_ppr:={left: 90}'], ['ppr.right']),
    'ppr zero of one wheel': (ODOM, ['_ppr:={left: 90, right: 0}'], ['ppr.right', '0', PPR_ALLOWED]),
    'ppr of 401 digits': (ENCODER, ['_ppr:=1' + '0' * 400], ['ppr', '1000', 'allowed']),
    'ppr far too small': (ODOM, ['_ppr:=1.0e-300'], ['ppr', '1e-300', PPR_ALLOWED]),
    'octal of one wheel': (ODOM, ['_ppr:={left: 0100, right: 90, x: }'], ['ppr', '0100', 'YAML 1.1', '64']),
    'diameter of no robot': (ODOM, ['_wheel_diameter:=1.0e+300'], ['wheel_diameter', '1e+300', '0.001 to 100 [m]']),
    'window of 64 bits': (ODOM, ['_velocity_window:=9223372036854775808'], ['velocity_window', '922337', '1 to 10000']),
    'long path': (SIMULATOR, [WORLD, '_robot:=' + 'x' * 5000], ['robot', 'xxx', 'a file name, or a path']),
    'misspelt': (ENCODER, ['_counter_modulos:=65536'], ['counter_modulos', 'counter_modulus']),
    'unknown': (ODOM, ['_colour:=red'], ['colour']),
    'same joint twice': (
        ENCODER,
        ['_left_joint:=wheel', '_right_joint:=wheel'],
        ['left_joint', 'wheel', 'another joint than right_joint'],
    ),
    'modulus': (ODOM, ['_counter_modulus:=1'], ['counter_modulus', '1', '2']),
    'rate': (ENCODER, ['_rate:=0'], ['rate', '0', '0.001 to 1e6 [Hz]']),
    'window': (ODOM, ['_velocity_window:=0'], ['velocity_window', '0', '1 to 10000']),
    'diameter': (ODOM, ['_wheel_diameter:=-0.2'], ['wheel_diameter', '-0.2', '0.001 to 100 [m]']),
    'flag': (ODOM, ['_publish_tf:=maybe'], ['publish_tf', 'maybe', 'boolean']),
    'model states rate': ('world_pose_node', ['_rate:=fast'], ['rate', 'fast', 'number']),
    'map in world': ('world_pose_node', ['_map_in_world:={x: far}'], ['map_in_world.x', 'far', 'number']),
    'empty frame': ('global_pose_node', ["_map_frame:=''"], ['map_frame', "''"]),
    'ideal misspelt': ('ideal_odom_node', ['_modle:=alto'], ['modle', 'model']),
    'no trial': ('scripted_drive_node', [], ['/trial', 'trial.launch']),
    'no world': (SIMULATOR, [ROBOT], ['world', 'missing']),
    'missing world': (SIMULATOR, [ROBOT, '_world:={}/nowhere.world'], ['nowhere.world', 'No such file']),
    'torn world': (SIMULATOR, [ROBOT, '_world:={}/torn.world'], ['torn.world', 'not valid XML']),
    'no floor': (SIMULATOR, [ROBOT, '_world:={}/no_floor.world'], ['no_floor.world', 'floor']),
    'mesh': (SIMULATOR, [ROBOT, '_world:={}/mesh.world'], ['mesh.world', 'mesh', 'box']),
    'missing robot': (SIMULATOR, [WORLD, '_robot:={}/nobody.urdf'], ['nobody.urdf', 'but there is no']),
    'torn robot': (SIMULATOR, [WORLD, '_robot:={}/torn.urdf'], ['torn.urdf', 'not well-formed XML']),
    'misspelt joint': (
        SIMULATOR,
        [WORLD, ROBOT, '_left_joint:=left_weel_joint'],
        ['left_weel_joint', "did you mean 'left_wheel_joint'"],
    ),
    'real time factor': (
        SIMULATOR,
        [WORLD, ROBOT, '_real_time_factor:=-1'],
        ['real_time_factor', '-1', '0, or 0.001 to 1e6'],
    ),
    'command period': (SIMULATOR, [WORLD, ROBOT, '_command_period:=0.02'], ['command_period', '0.02', 'above 20 ms']),
    'scan rate': (SIMULATOR, [WORLD, ROBOT, '_lidar:={rate: 30}'], ['lidar', "'rate': 30", 'whole 10 ms']),
    'limit': (
        SIMULATOR,
        [WORLD, ROBOT, '_drive:={max_linear_speed: 0}'],
        ['drive.max_linear_speed', '0', '0.001 to 100 [m/s]'],
    ),
}

# What is wrong: arguments of trial.launch, words of one line
BAD_ARGUMENTS = {
    'test': (['test:=XX'], ['test', 'XX', 'SL', 'SMT']),
    'ppr zero': (['ppr:=0'], ['ppr', '0', PPR_ALLOWED]),
    'ppr nan': (['ppr:=nan'], ['ppr', 'nan', PPR_ALLOWED]),
    'ppr of 401 digits': (['ppr:=1' + '0' * 400], ['ppr', '1000', PPR_ALLOWED]),
    'ppr octal': (['ppr:=0100'], ['ppr', '0100', 'YAML 1.1', '64']),
    'long path': (['robot:=' + 'x' * 5000, 'bag:=none'], ['xxx', 'File name too long']),
    'sim': (['sim:=foo'], ['sim', 'foo', 'pybullet', 'gazebo']),
    'bag': (['bag:={}/exists.bag'], ['bag', 'exists.bag', 'exists', 'new file']),
    'robot': (['robot:={}/nobody.urdf', 'bag:=none'], ['nobody.urdf', 'but there is no']),
    'missing config': (['config:={}/nowhere.yaml'], ['nowhere.yaml']),
    'config is no YAML': (['config:={}/no_yaml.yaml'], ['no_yaml.yaml', 'YAML']),
    'nav': (['nav:=foo'], ['nav', 'foo', 'embedded', 'upstream', 'scripted']),
    'no route': (['test:={}/no_route.yaml'], ['nav', 'embedded', 't has no route', 'scripted']),
    'map': (['map:={}/nowhere.yaml'], ['map', 'nowhere.yaml', 'rasterise_world']),
}

# The same by trial_spec alone, to which trial.launch hands its arguments: words of its line
BAD_SPECS = {
    'ppr text': (['--ppr=many'], ['ppr', 'many', PPR_ALLOWED]),
    'ppr negative for a wheel': (['--ppr={left: 40, right: -4}'], ['ppr.right', '-4', PPR_ALLOWED]),
    'ppr is no YAML': (['--ppr={left: 40'], ['ppr', '{left: 40', PPR_ALLOWED]),
    'ppr octal': (['--ppr=0100'], ['ppr', '0100', 'YAML 1.1', '64']),
    'config with a key twice': (['--config={}/twice.yaml'], ['twice.yaml, line 2', 'rate', 'line 1']),
    'slam with a sexagesimal': (['--slam-config={}/minutes.yaml'], ['minutes.yaml, line 1', '1:30', '90']),
    'odom': (['--odom=foo'], ['odom', 'foo', 'encoder', 'ideal']),
    'trial negative': (['--trial=-1'], ['trial: given', '-1', '0 to']),
    'trial text': (['--trial=first'], ['trial: given', 'first', 'integer']),
    'bag where nothing can be written': (['--bag=/proc/1/new.bag'], ['bag', '/proc/1']),
    'config is a list': (['--config={}/list.yaml'], ['list.yaml', 'list']),
    'config misspelt': (['--config={}/misspelt.yaml'], ['misspelt.yaml', 'wheel_diametre', 'wheel_diameter']),
    'config value': (['--config={}/negative.yaml'], ['negative.yaml', 'wheel_diameter', '-0.2', '0.001 to 100 [m]']),
    'test names no world': (['--test={}/no_such_world.yaml', '--nav=scripted'], ['world', 'moon', 'hallway']),
    'test with two motions': (['--test={}/two_motions.yaml'], ['two_motions.yaml', 'straight', 'turns']),
    'test without a drive': (['--test={}/no_drive.yaml'], ['no_drive.yaml', 'drive']),
}


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Where FILES are."""
    folder = tmp_path_factory.mktemp('bad_arguments')
    for name, text in FILES.items():
        (folder / name).write_text(text)
    return folder


@pytest.fixture(scope='module')
def outcomes(folder):
    """What each bad start ended with. They run side by side, as starting is all that they do."""
    require_ros()
    with Graph(folder / 'ros') as graph, ThreadPoolExecutor(3) as pool:
        core = graph.start('roscore', '-p', str(graph.port))
        graph.run(sys.executable, '-c', AWAIT_MASTER)
        runs = {}
        for index, (name, (node, parameters, _)) in enumerate(BAD_PARAMETERS.items()):
            # a name of its own, as parameters outlive the node
            command = [sys.executable, SCRIPTS / node, f'__name:=bad_{index}', *in_folder(parameters, folder)]
            runs['node', name] = pool.submit(run_and_read, graph, command)
        for name, (arguments, _) in BAD_ARGUMENTS.items():
            runs['launch', name] = pool.submit(run_and_read, graph, ['roslaunch', TRIAL, *in_folder(arguments, folder)])
        yield {key: run.result() for key, run in runs.items()}
        core.send_signal(2)
        core.wait(20.0)


def in_folder(arguments, folder):
    return [argument.replace('{}', str(folder)) for argument in arguments]


def run_and_read(graph, command):
    """(exit code or None when it had to be ended, lines of output)"""
    process = graph.start(*command)
    try:
        code = process.wait(20.0)
    except pytest.fail.Exception:
        process.send_signal(9)
        code = None
    return code, [line for line in process.output().splitlines() if line.strip() and 'pybullet build time' not in line]


@pytest.mark.parametrize('name', list(BAD_PARAMETERS))
def test_node_names_the_bad_parameter_in_one_line(name, outcomes):
    code, lines = outcomes['node', name]
    shown = '\n'.join(lines)
    assert code is not None, 'the node runs:\n' + shown
    assert code == 1, shown
    assert len(lines) == 1, shown
    for word in BAD_PARAMETERS[name][2]:
        assert word in lines[0]


@pytest.mark.parametrize('name', list(BAD_ARGUMENTS))
def test_trial_names_the_bad_argument_in_one_line(name, outcomes):
    code, lines = outcomes['launch', name]
    shown = '\n'.join(lines)
    assert code == 1, shown
    assert 'Traceback (most recent call last)' not in shown
    words = BAD_ARGUMENTS[name][1]
    naming = [line for line in lines if all(word in line for word in words)]
    assert naming, shown
    assert 'process[simulator_node' not in shown  # nothing was started


@pytest.mark.parametrize('name', list(BAD_SPECS))
def test_trial_spec_names_the_bad_argument_in_one_line(name, folder):
    arguments, words = BAD_SPECS[name]
    good = {'--test': 'SL', '--bag': 'none'}
    good.update(argument.split('=', 1) for argument in in_folder(arguments, folder))
    with pytest.raises(SystemExit) as stopped:
        trial_spec_main(['{}={}'.format(*pair) for pair in good.items()])
    text = stopped.value.code
    assert '\n' not in text
    for word in words:
        assert word in text


def test_good_robot_file_is_taken(tmp_path):
    """The one that the bad ones differ from."""
    robot = load(tmp_path / 'good.urdf', 'radius="0.1"', 'xyz="0 0.2 0"')
    assert robot.wheels == pytest.approx((0.1, 0.1, 0.4))


@pytest.mark.parametrize('name', list(BAD_ROBOTS))
def test_robot_file_with_bad_numbers(name, tmp_path):
    radius, origin, words = BAD_ROBOTS[name]
    with pytest.raises(ConfigError) as error:
        load(tmp_path / 'bad.urdf', radius, origin)
    for word in ['bad.urdf', *words]:
        assert word in str(error.value)
    assert '\n' not in str(error.value)


def load(path, radius, origin):
    path.write_text(ROBOT_FILE.format(radius=radius, origin=origin))
    return load_simulated_robot(RobotSource(path), RobotChoices('left_wheel_joint', 'right_wheel_joint'))


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
