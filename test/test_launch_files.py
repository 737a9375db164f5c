"""What each launch file starts for which arguments, with which parameters, and that all of it is there.

Upstream's navigation and Gazebo may be missing; packages of the same names take their place, whose programs write down
how they were started.
"""

import contextlib
import functools
import itertools
import os
import re
import shlex
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from documented_commands import fences
from launched_graph import DATA, ROOT, Graph, require_ros, wait_until

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

LAUNCH, SCRIPTS = ROOT / 'launch', ROOT / 'scripts'
TRIAL = LAUNCH / 'trial.launch'
OWN = 'diff_encoder_sim'
OPTIONAL, WHEEL_NODES = {'rviz'}, ('/gz_diff_encoder_node', '/gz_diff_odom_node')
UPSTREAM, ENCODER = ('map_server', 'amcl', 'move_base'), {'gz_diff_encoder_node', 'gz_diff_odom_node'}
AMCL, NAVIGATION, SLAM = (
    yaml.safe_load((ROOT / 'config' / name).read_text()) for name in ('amcl.yaml', 'navigation.yaml', 'slam.yaml')
)

CHOICES = {
    'nav': ('embedded', 'upstream', 'scripted'),
    'sim': ('pybullet', 'gazebo'),
    'odom': ('encoder', 'ideal'),
    'rviz': ('true', 'false'),
    'bag': ('', 'none'),
}
DEFAULTS = {name: values[0] for name, values in CHOICES.items()}
COMBINATIONS = [
    DEFAULTS,
    *({**DEFAULTS, name: value} for name, values in CHOICES.items() for value in values[1:]),
    {name: values[-1] for name, values in CHOICES.items()},
    {'nav': 'upstream', 'sim': 'gazebo', 'odom': 'ideal', 'rviz': 'true', 'bag': 'none'},
]


def trial_nodes(nav, sim, odom, rviz, bag):
    """{node: (package, type)} of trial.launch"""
    nodes = {'robot_state_publisher': ('robot_state_publisher', 'robot_state_publisher')}
    own = ['world_pose_node', 'global_pose_node']
    own += ['simulator_node'] if sim == 'pybullet' else []
    own += ['gz_diff_encoder_node', 'gz_diff_odom_node'] if odom == 'encoder' else ['ideal_odom_node']
    own += ['scripted_drive_node'] if nav == 'scripted' else ['navigation_trial_node']
    own += ['record_trial'] if bag != 'none' else []
    own += ['trial_view_node'] if rviz == 'true' else []
    nodes.update({name: (OWN, name) for name in own})
    if sim == 'gazebo':
        nodes.update(dict.fromkeys(('gazebo', 'spawn_robot'), (OWN, 'gazebo_trial')))
    if nav != 'scripted':
        nodes.update({name: (OWN, 'upstream_node' if nav == 'upstream' else name + '_node') for name in UPSTREAM})
    if rviz == 'true':
        nodes['rviz'] = ('rviz', 'rviz')
    return nodes


def words(choice):
    return ['{}:={}'.format(*pair) for pair in choice.items()]


@pytest.fixture
def load(monkeypatch):
    """Loads a launch file as roslaunch does, but runs no command: (what it holds, commands of parameters)."""
    require_ros()
    import roslaunch.config
    import roslaunch.loader

    commands = {}
    as_it_is = roslaunch.loader.Loader.param_value

    def param_value(self, verbose, name, ptype, value, textfile, binfile, command):
        if command is None:
            return as_it_is(self, verbose, name, ptype, value, textfile, binfile, command)
        commands[name] = shlex.split(command)
        return 'output of a command'

    monkeypatch.setattr(roslaunch.loader.Loader, 'param_value', param_value)

    def load(path, *arguments):
        commands.clear()
        file = (str(path), list(arguments))
        return roslaunch.config.load_config_default([file], None, assign_machines=False), commands

    return load


def types(config):
    return {node.name: (node.package, node.type) for node in config.nodes}


def params(config):
    return {name: param.value for name, param in config.params.items()}


@functools.lru_cache(maxsize=None)
def is_executable(package, node_type):
    """As roslaunch finds it, which walks through all of the package's folders."""
    import roslib.packages

    found = roslib.packages.find_node(package, node_type)
    return bool(found) and os.access(found[0], os.X_OK)


def check_all_is_there(config):
    for node in config.nodes:
        assert node.package in OPTIONAL or is_executable(node.package, node.type), node.name
    texts = [text for text in params(config).values() if isinstance(text, str)]
    texts += [node.args for node in config.nodes]
    for word in itertools.chain(*(text.split() for text in texts)):
        if word.startswith('/'):
            assert Path(word).exists(), word
    for file in config.roslaunch_files:
        assert Path(file).is_file(), file


@pytest.mark.parametrize('choice', COMBINATIONS, ids=lambda choice: '-'.join(filter(None, choice.values())))
def test_trial_starts_what_it_should(choice, load):
    config, commands = load(TRIAL, *words(choice))
    assert types(config) == trial_nodes(**choice)
    roles = {'gazebo': 'server', 'spawn_robot': 'spawn', **{name: name for name in UPSTREAM}}
    for node in config.nodes:
        assert node.type not in ('upstream_node', 'gazebo_trial') or node.args.strip() == roles[node.name]
    check_all_is_there(config)
    spec = commands['trial']
    for name in ('nav', 'sim', 'odom', 'bag'):
        assert f'--{name}={choice[name]}' in spec
    must_stay = {node.name for node in config.nodes if node.required}
    may_end = {'robot_state_publisher', 'spawn_robot', 'trial_view_node', 'rviz'}
    assert must_stay == set(types(config)) - may_end


@pytest.mark.parametrize('nav', ['embedded', 'upstream'])
def test_both_stacks_get_the_same_parameters(nav, load):
    config, _ = load(TRIAL, 'nav:=' + nav)
    found = params(config)
    for name, value in AMCL.items():
        assert found['/amcl/' + name] == value
    for name in ('controller_frequency', 'base_local_planner', 'latch_xy_goal_tolerance'):
        assert found['/move_base/' + name] == NAVIGATION[name]
    assert found['/move_base/DWAPlannerROS/max_vel_x'] == NAVIGATION['DWAPlannerROS']['max_vel_x']
    assert found['/move_base/local_costmap/scan/clearing'] is True
    assert {'/amcl/', '/move_base/'} <= {name.rstrip('/') + '/' for name in config.clear_params}
    assert '/simulator_node/command_period' not in found  # that of /trial


@pytest.mark.parametrize('fusion', ['embedded', 'upstream'])
def test_fusion_has_the_transform_and_navigation_its_odometry(fusion, load):
    usual = load(TRIAL)[0]
    config, commands = load(TRIAL, f'fusion:={fusion}', 'imu:=bno055')
    types_of_fusion = {'embedded': (OWN, 'odometry_fusion_node'), 'upstream': (OWN, 'upstream_node')}
    assert types(config) == {**types(usual), 'odometry_fusion_node': types_of_fusion[fusion]}
    remapped = {node.name: list(node.remap_args) for node in config.nodes if node.name in ('amcl', 'move_base')}
    assert remapped == {'amcl': [], 'move_base': [['odom', 'odometry/filtered']]}
    assert {'--imu=bno055', f'--fusion={fusion}'} <= {*commands['trial']} & {*commands['/robot_settings']}
    found = params(config)
    waited_for = ['/odom', '/odometry/filtered'] if fusion == 'embedded' else ['/odom']
    assert found['/simulator_node/wait_for'] == waited_for
    if fusion == 'upstream':  # its order: position, rotation, their speeds, acceleration
        fused = {
            key: np.flatnonzero(found[f'/odometry_fusion_node/{key}_config']).tolist() for key in ('odom0', 'imu0')
        }
        assert fused == {'odom0': [6, 11], 'imu0': [11]}
        assert (found['/odometry_fusion_node/odom0'], found['/odometry_fusion_node/imu0']) == ('odom', 'imu/data')
        assert len(found['/odometry_fusion_node/odom0_config']) == len(found['/odometry_fusion_node/imu0_config']) == 15
    check_all_is_there(config)


def test_a_users_own_files_reach_their_nodes(tmp_path, load):
    (tmp_path / 'amcl.yaml').write_text('laser_max_beams: 7\n')
    (tmp_path / 'navigation.yaml').write_text('DWAPlannerROS: {max_vel_x: 0.1}\n')
    files = [f'{name}_config:={tmp_path}/{name}.yaml' for name in ('amcl', 'navigation')]
    config, commands = load(TRIAL, *files, 'map:=my.yaml')
    found = params(config)
    assert (found['/amcl/laser_max_beams'], found['/move_base/DWAPlannerROS/max_vel_x']) == (7, 0.1)
    assert '/move_base/controller_frequency' not in found
    assert {'--map=my.yaml', f'--navigation-config={tmp_path}/navigation.yaml'} <= set(commands['trial'])


@pytest.mark.parametrize(
    ('file', 'arguments', 'expected'),
    [
        ('encoder_odometry.launch', [], ENCODER),
        ('simulator.launch', [], {'simulator_node'}),
        ('teleop.launch', [], {*ENCODER, 'simulator_node', 'world_pose_node', 'robot_state_publisher'}),
        ('gazebo.launch', [], {'gazebo', 'spawn_robot'}),
        ('navigation.launch', [], set(UPSTREAM)),
        ('navigation.launch', ['stack:=upstream'], set(UPSTREAM)),
    ],
)
def test_each_part_can_be_launched_alone(file, arguments, expected, load):
    config, _ = load(LAUNCH / file, *arguments)
    assert set(types(config)) == expected
    check_all_is_there(config)


@pytest.mark.parametrize('slam', ['embedded', 'upstream'])
@pytest.mark.parametrize('odom', ['ideal', 'encoder'])
def test_mapping_drives_and_maps(slam, odom, load):
    config, commands = load(LAUNCH / 'mapping.launch', 'world:=ros_logo', 'slam:=' + slam, 'odom:=' + odom)
    expected = trial_nodes(nav='scripted', sim='pybullet', odom=odom, rviz='false', bag='none')
    own = 'slam_node' if slam == 'embedded' else 'upstream_node'
    assert types(config) == {**expected, 'slam_gmapping': ('diff_encoder_sim', own)}
    check_all_is_there(config)
    found = params(config)
    assert found['/slam_gmapping/particles'] == SLAM['particles']
    assert 'simulator.lidar.noise:=0.01' in commands['/robot_settings']  # as the paper maps with
    assert {'--save-map=maps/ros_logo', '--slam=' + slam} <= set(commands['trial'])
    assert any(word.endswith('/config/mapping/ros_logo.yaml') for word in commands['trial'])


@pytest.mark.parametrize('file', ['trial', 'encoder_odometry', 'mapping', 'replay', 'simulator', 'teleop'])
def test_every_launch_file_that_starts_a_robot_sets_its_settings_once(file, load):
    needed = ['bag:=drive.bag'] if file == 'replay' else []
    config, commands = load(LAUNCH / f'{file}.launch', 'robot:=mine.yaml', 'robot_args:=a=1 b=2', *needed)
    assert commands['/robot_settings'][3] == 'mine.yaml'
    assert '--robot-args=a=1 b=2' in commands['/robot_settings']
    assert '/gz_diff_encoder_node/ppr' not in params(config) or params(config)['/gz_diff_encoder_node/ppr'] == 90


def test_launch_arguments_go_before_the_robot(load):
    _, commands = load(TRIAL, 'ppr:={left: 40, right: 90}', 'lidar_noise:=0.02')
    expected = ['alto', 'config.ppr:={left: 40, right: 90}', 'simulator.lidar.noise:=0.02']
    assert commands['/robot_settings'][3:6] == expected
    _, commands = load(LAUNCH / 'replay.launch', 'bag:=b.bag', 'left:=l', 'right:=r')
    assert {'config.left_joint:=l', 'config.right_joint:=r', '--bag=b.bag'} <= set(commands['/robot_settings'])


def test_every_node_forgets_the_parameters_of_the_launch_before(load):
    """A node writes the values in use; without clear_params the next launch on the same master would find them."""
    of_mapping = ['odom:=ideal', 'slam:=embedded', 'nav:=scripted']
    for file, arguments in (('trial', []), ('trial', of_mapping), ('teleop', [])):
        config, _ = load(LAUNCH / f'{file}.launch', *arguments)
        without = ('record_trial', 'gazebo_trial', 'trial_view_node')
        nodes = {f'/{node.name}/' for node in config.nodes if node.package == OWN and node.type not in without}
        assert nodes - set(config.clear_params) == set(), file


def test_the_documented_launch_file_starts_what_it_should(tmp_path, load):
    lines = (ROOT / 'docs' / 'live_trials.md').read_text().splitlines()
    (recipe,) = [fence for fence in fences(lines) if fence.language == 'xml']
    (tmp_path / 'own.launch').write_text('\n'.join(recipe.lines))
    config, commands = load(tmp_path / 'own.launch')
    assert set(types(config)) == {*ENCODER, 'simulator_node', 'world_pose_node'}
    assert 'config.ppr:=40' in commands['/robot_settings']
    check_all_is_there(config)


# --- by the commands that users type: no master, and nothing else, runs -------------------------------


def test_a_missing_package_is_named_before_anything_starts(tmp_path):
    import rospkg

    require_ros()
    # This workspace can be found, and what trial.launch always needs, and nothing else.
    packages, needed = rospkg.RosPack(), tmp_path / 'needed'
    needed.mkdir()
    for name in ('robot_state_publisher', 'roslaunch'):
        (needed / name).symlink_to(packages.get_path(name))
    with Graph(tmp_path) as graph:
        graph.environment['ROS_PACKAGE_PATH'] = f'{Path(packages.get_path(OWN)).parent}:{needed}'
        launch = graph.launch(TRIAL, 'nav:=upstream', 'bag:=none')
        assert launch.wait() != 0
        lines = [line for line in launch.output().splitlines() if line.startswith('trial.launch: ')]
        assert len(lines) == 1 and 'process[' not in launch.output(), launch.output()
        missing = 'map_server, amcl, move_base, dwa_local_planner are'
        for part in ('nav: given upstream, but ', 'not installed', missing, 'ros-noetic-navigation', 'nav:=embedded'):
            assert part in lines[0]


def test_teleop_starts_ros_own_nodes_for_a_joystick(tmp_path):
    """joy and teleop_twist_joy publish /cmd_vel; a stand-in has their launch file's name and argument."""
    require_ros()
    with Graph(tmp_path / 'ros') as graph:
        graph.add_packages(tmp_path / 'packages', {'teleop_twist_joy': {}})
        folder = tmp_path / 'packages' / 'teleop_twist_joy' / 'launch'
        folder.mkdir()
        (folder / 'teleop.launch').write_text(
            '<launch><arg name="joy_config"/><param name="/joystick" value="$(arg joy_config)"/></launch>'
        )
        code, output = graph.run(
            'roslaunch', '--dump-params', LAUNCH / 'teleop.launch', 'joystick:=xbox', 'start:={x: 1.0, yaw: 0.5}'
        )
    assert code == 0, output
    found = yaml.safe_load(output)
    assert found['/joystick'] == 'xbox'
    assert (found['/simulator_node/start/x'], found['/simulator_node/start/yaw']) == (1.0, 0.5)


# --- on one master: the programs that take upstream's names, and the parameters of launches one after the other -------

WRITE_ARGUMENTS = '#!/bin/sh\nfor word; do echo "$word"; done > "$STARTED/$(basename "$0")"\n'
REMAPPINGS = ['__name:=this', 'scan:=front/scan', '__log:=/tmp/none.log']
MY_AMCL = '__name:=my_amcl'


@pytest.fixture(scope='module')
def graph(tmp_path_factory):
    """A master that outlives the launches, with a trial's parameter, and the other packages."""
    require_ros()
    folder = tmp_path_factory.mktemp('one_master')
    with Graph(folder / 'ros') as graph:
        graph.add_packages(
            folder / 'packages',
            {
                **{name: {name: WRITE_ARGUMENTS} for name in UPSTREAM},
                'dwa_local_planner': {},
                'robot_localization': {'ekf_localization_node': WRITE_ARGUMENTS},
                'gazebo_ros': {'gzserver': WRITE_ARGUMENTS, 'spawn_model': WRITE_ARGUMENTS},
            },
        )
        graph.environment['STARTED'] = str(graph.home)
        graph.start_master()
        spec = ('--test=SMT', '--nav=upstream', '--sim=gazebo', '--bag=none')
        code, plan = graph.run(sys.executable, SCRIPTS / 'trial_spec', *spec)
        assert code == 0, plan
        graph.master.setParam('/trial', yaml.safe_load(plan.splitlines()[-1]))  # below the line on stopping
        yield graph


def started_with(graph, program, *command):
    """Arguments that a program was started with by one of our executables."""
    code, output = graph.run(sys.executable, SCRIPTS / command[0], *command[1:])
    assert code == 0, output
    return (graph.home / program).read_text().splitlines()


# Of amcl, initial_pose_y is among its parameters.
SPAWNED = '-urdf -param gazebo_robot_description -model alto -x -3.4 -y -0.85 -Y 0.0'
PROGRAMS = [
    ('map_server', ['upstream_node', 'map_server', *REMAPPINGS], [f'{ROOT}/worlds/ros_logo.yaml', *REMAPPINGS]),
    ('amcl', ['upstream_node', 'amcl', MY_AMCL], ['_initial_pose_x:=-3.4', '_initial_pose_a:=0.0', MY_AMCL]),
    ('ekf_localization_node', ['upstream_node', 'ekf_localization_node', '__name:=ekf'], ['__name:=ekf']),
    ('gzserver', ['gazebo_trial', 'server'], ['-u', '-e', 'ode', f'{ROOT}/worlds/ros_logo.world']),
    ('spawn_model', ['gazebo_trial', 'spawn'], SPAWNED.split()),
]


@pytest.mark.parametrize(('program', 'command', 'expected'), PROGRAMS)
def test_other_packages_programs_get_the_trials_map_world_and_start(graph, program, command, expected):
    graph.master.setParam('/my_amcl', {'initial_pose_y': 1.0})
    assert started_with(graph, program, *command) == expected


def test_upstreams_nodes_find_the_robots_settings_among_their_parameters(graph):
    # Of PyBullet's wheels it has nothing to warn of.
    code, settings = graph.run(sys.executable, SCRIPTS / 'robot_settings', 'burger', '--sim', 'pybullet')
    assert code == 0, settings
    graph.master.setParam('/robot_settings', yaml.safe_load(settings))
    graph.master.setParam('/my_base/local_costmap/width', 2.5)
    started_with(graph, 'move_base', 'upstream_node', 'move_base', '__name:=my_base')
    costmap = graph.master.getParam('/my_base/local_costmap')
    assert costmap['width'] == 2.5 and costmap['robot_base_frame'] == 'base_footprint' and costmap['footprint']
    assert started_with(graph, 'spawn_model', 'gazebo_trial', 'spawn')[4] == 'burger'


def assert_parameters(graph, launch, nodes, **expected):
    """Until these private parameters of all nodes have their values."""

    def private(node, name):
        return graph.master.getParam(f'{node}/{name}') if graph.master.hasParam(f'{node}/{name}') else None

    wait_until(lambda: all(private(node, key) == value for node in nodes for key, value in expected.items()), launch)


# In this order: none finds the value of the one before.
@pytest.mark.parametrize(
    ('arguments', 'ppr', 'of_encoder', 'of_odometry'),
    [
        (['encoder:=amt102'], 8192, {'encoder/lines': 2048}, {'base_frame': 'base_link'}),
        (['robot:=burger'], 4096, {'encoder/noise': 0.0}, {'base_frame': 'base_footprint'}),
    ],
)
def test_parameters_show_the_values_in_use_of_each_launch(graph, arguments, ppr, of_encoder, of_odometry):
    launch = graph.launch(LAUNCH / 'encoder_odometry.launch', *arguments)
    assert_parameters(graph, launch, WHEEL_NODES, ppr=ppr)
    assert_parameters(graph, launch, WHEEL_NODES[:1], **of_encoder)
    assert_parameters(graph, launch, WHEEL_NODES[1:], **of_odometry)
    launch.end()


# --- a trial with nodes that behave as upstream's do -------------------------------------------------


@pytest.fixture(scope='module')
def upstream_trial(tmp_path_factory):
    """(exit code, output, published topics, whether all processes ended) of a trial of ours under upstream's names.

    move_base offers its action only when time runs. What rviz:=true starts is there, except RViz itself.
    """
    require_ros()
    folder = tmp_path_factory.mktemp('upstream_trial')
    become = '#!/bin/sh\nexec %s %s/%s_node "$@"\n'
    programs = {name: {name: become % (sys.executable, SCRIPTS, name)} for name in UPSTREAM}
    wait = f'{sys.executable} {DATA.parent}/wait_for_clock.py 1.0 || exit 1\nexec'
    programs['move_base']['move_base'] = programs['move_base']['move_base'].replace('exec', wait)
    published = set()
    with Graph(folder / 'ros') as graph:
        graph.add_packages(folder / 'packages', {**programs, 'dwa_local_planner': {}})
        launch = graph.launch(TRIAL, f'test:={DATA}/short_route.yaml', 'nav:=upstream', 'rtf:=2', 'bag:=none')
        view = graph.start_view()

        def is_over():
            with contextlib.suppress(OSError):
                published.update(topic for topic, _ in graph.master.getSystemState()[0])
            return launch.has_ended()

        wait_until(is_over, launch, 120.0)
        code = launch.wait()
        view.send_signal(signal.SIGKILL)
        yield code, launch.output(), published, graph.is_gone()


def test_a_trial_with_upstreams_nodes_reaches_its_goal(upstream_trial):
    code, output, _, is_gone = upstream_trial
    assert code == 0, output
    assert 'trial succeeded' in output
    assert is_gone, 'it left processes behind'


def test_all_that_rviz_shows_is_published(upstream_trial):
    text = (ROOT / 'config' / 'rviz' / 'trial.rviz').read_text()
    shown = set(re.findall(r'Topic: (/\S+)', text)) - {'/initialpose', '/move_base_simple/goal'}  # RViz's own
    assert len(shown) == 18
    assert shown - upstream_trial[2] == set()
