"""What each launch file starts for which arguments, and that all of it is there.

Upstream's navigation and Gazebo may be missing; packages of the same names take their place, whose
programs write down how they were started.
"""

import functools
import itertools
import os
import re
import shlex
import sys
from pathlib import Path

import pytest
import yaml

from launched_graph import DATA, ROOT, Graph, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

LAUNCH, SCRIPTS = ROOT / 'launch', ROOT / 'scripts'
TRIAL = LAUNCH / 'trial.launch'
OWN = 'diff_encoder_sim'
OPTIONAL = {'rviz'}
UPSTREAM = ('map_server', 'amcl', 'move_base')
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


@pytest.mark.parametrize('launch', ['trial.launch', 'navigation.launch'])
def test_the_accurate_amcl_can_be_chosen(launch, load):
    path = ROOT / 'config' / 'amcl_accurate.yaml'
    config, _ = load(LAUNCH / launch, f'amcl_config:={path}')
    found, expected = params(config), yaml.safe_load(path.read_text())
    assert {name: found['/amcl/' + name] for name in expected} == expected


def test_a_users_own_files_reach_their_nodes(tmp_path, load):
    (tmp_path / 'amcl.yaml').write_text('laser_max_beams: 7\n')
    (tmp_path / 'navigation.yaml').write_text('DWAPlannerROS: {max_vel_x: 0.1}\n')
    config, commands = load(
        TRIAL, f'amcl_config:={tmp_path}/amcl.yaml', 'map:=my.yaml', f'navigation_config:={tmp_path}/navigation.yaml'
    )
    found = params(config)
    assert found['/amcl/laser_max_beams'] == 7
    assert found['/move_base/DWAPlannerROS/max_vel_x'] == 0.1
    assert '/move_base/controller_frequency' not in found
    assert '--map=my.yaml' in commands['trial']
    assert f'--navigation-config={tmp_path}/navigation.yaml' in commands['trial']


@pytest.mark.parametrize(
    ('file', 'arguments', 'expected'),
    [
        ('encoder_odometry.launch', [], {'gz_diff_encoder_node', 'gz_diff_odom_node'}),
        ('simulator.launch', [], {'simulator_node'}),
        (
            'teleop.launch',
            [],
            {'simulator_node', 'gz_diff_encoder_node', 'gz_diff_odom_node', 'world_pose_node', 'robot_state_publisher'},
        ),
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
    assert '--save-map=maps/ros_logo' in commands['trial'] and '--slam=' + slam in commands['trial']
    assert any(
        word.startswith('--test=/') and word.endswith('/config/mapping/ros_logo.yaml') for word in commands['trial']
    )


@pytest.mark.parametrize('file', ['trial', 'encoder_odometry', 'mapping', 'replay', 'simulator', 'teleop'])
def test_every_launch_file_that_starts_a_robot_sets_its_settings_once(file, load):
    needed = ['bag:=drive.bag'] if file == 'replay' else []
    config, commands = load(LAUNCH / f'{file}.launch', 'robot:=mine.yaml', 'robot_args:=a=1 b=2', *needed)
    assert commands['/robot_settings'][3] == 'mine.yaml'
    assert '--robot-args=a=1 b=2' in commands['/robot_settings']
    assert '/gz_diff_encoder_node/ppr' not in params(config) or params(config)['/gz_diff_encoder_node/ppr'] == 90


def test_launch_arguments_go_before_the_robot(load):
    _, commands = load(TRIAL, 'ppr:={left: 40, right: 90}', 'lidar_noise:=0.02')
    assert commands['/robot_settings'][3:6] == [
        'alto',
        'config.ppr:={left: 40, right: 90}',
        'simulator.lidar.noise:=0.02',
    ]
    _, commands = load(LAUNCH / 'replay.launch', 'bag:=b.bag', 'left:=l', 'right:=r')
    assert {'config.left_joint:=l', 'config.right_joint:=r', '--bag=b.bag'} <= set(commands['/robot_settings'])


def test_no_launch_file_is_forgotten():
    assert {file.name for file in LAUNCH.iterdir()} == {
        'trial.launch',
        'encoder_odometry.launch',
        'simulator.launch',
        'gazebo.launch',
        'navigation.launch',
        'slam.launch',
        'mapping.launch',
        'replay.launch',
        'teleop.launch',
    }


# --- by the commands that users type: no master, and nothing else, runs -------------------------------


@pytest.mark.parametrize(
    ('argument', 'missing'),
    [
        (
            'nav:=upstream',
            ['map_server, amcl, move_base, dwa_local_planner are', 'ros-noetic-navigation', 'nav:=embedded'],
        )
    ],
)
def test_a_missing_package_is_named_before_anything_starts(argument, missing, tmp_path):
    require_ros()
    with Graph(tmp_path) as graph:
        hide_other_packages(graph)
        launch = graph.launch(TRIAL, argument, 'bag:=none')
        assert launch.wait() != 0
        name, _, value = argument.partition(':=')
        lines = [line for line in launch.output().splitlines() if line.startswith('trial.launch: ')]
        assert len(lines) == 1, launch.output()
        for part in [f'{name}: given {value}, but ', 'not installed', *missing]:
            assert part in lines[0]
        assert 'process[' not in launch.output()


def hide_other_packages(graph):
    """Lets this workspace be found, what trial.launch always needs, and nothing else."""
    import rospkg

    packages = rospkg.RosPack()
    needed = graph.home / 'needed'
    needed.mkdir()
    for name in ('robot_state_publisher', 'roslaunch'):
        (needed / name).symlink_to(packages.get_path(name))
    graph.environment['ROS_PACKAGE_PATH'] = f'{Path(packages.get_path(OWN)).parent}:{needed}'


# --- the programs that take upstream's names ---------------------------------------------------------

AWAIT_MASTER = 'import rosgraph, time\nwhile not rosgraph.is_master_online(): time.sleep(0.05)'
WRITE_ARGUMENTS = '#!/bin/sh\nfor word; do echo "$word"; done > "$STARTED/$(basename "$0")"\n'


def make_packages(folder, programs):
    """Packages {name: {program: text}} in a folder of their own."""
    for package, texts in programs.items():
        (folder / package).mkdir(parents=True)
        (folder / package / 'package.xml').write_text(
            f'<package><name>{package}</name><version>1.0.0</version><description>a stand-in</description>'
            '<maintainer email="a@b.c">a</maintainer><license>BSD</license></package>'
        )
        for program, text in texts.items():
            (folder / package / program).write_text(text)
            (folder / package / program).chmod(0o755)


def add_packages(graph, folder):
    graph.environment['ROS_PACKAGE_PATH'] = '{}:{}'.format(folder, os.environ['ROS_PACKAGE_PATH'])


def test_teleop_starts_ros_own_nodes_for_a_joystick(tmp_path):
    """joy and teleop_twist_joy publish /cmd_vel; a stand-in has their launch file's name and argument."""
    require_ros()
    make_packages(tmp_path / 'packages', {'teleop_twist_joy': {}})
    folder = tmp_path / 'packages' / 'teleop_twist_joy' / 'launch'
    folder.mkdir()
    (folder / 'teleop.launch').write_text(
        '<launch><arg name="joy_config"/><param name="/joystick" value="$(arg joy_config)"/></launch>'
    )
    with Graph(tmp_path / 'ros') as graph:
        add_packages(graph, tmp_path / 'packages')
        code, output = graph.run(
            'roslaunch', '--dump-params', LAUNCH / 'teleop.launch', 'joystick:=xbox', 'start:={x: 1.0, yaw: 0.5}'
        )
    assert code == 0, output
    found = yaml.safe_load(output)
    assert found['/joystick'] == 'xbox'
    assert (found['/simulator_node/start/x'], found['/simulator_node/start/yaw']) == (1.0, 0.5)


@pytest.fixture(scope='module')
def stand_ins(tmp_path_factory):
    """A master with a trial's parameter, and the other packages, whose programs write their arguments."""
    require_ros()
    folder = tmp_path_factory.mktemp('stand_ins')
    make_packages(
        folder / 'packages',
        {
            **{name: {name: WRITE_ARGUMENTS} for name in UPSTREAM},
            'dwa_local_planner': {},
            'gazebo_ros': {'gzserver': WRITE_ARGUMENTS, 'spawn_model': WRITE_ARGUMENTS},
        },
    )
    with Graph(folder / 'ros') as graph:
        add_packages(graph, folder / 'packages')
        graph.environment['STARTED'] = str(folder)
        core = graph.start('roscore', '-p', str(graph.port))
        graph.run(sys.executable, '-c', AWAIT_MASTER)
        code, plan = graph.run(
            sys.executable, SCRIPTS / 'trial_spec', '--test=SMT', '--nav=upstream', '--sim=gazebo', '--bag=none'
        )
        assert code == 0, plan
        code, output = graph.run('rosparam', 'set', '/trial', plan.splitlines()[-1])  # below the line on stopping
        assert code == 0, output
        yield graph, folder
        core.send_signal(2)
        core.wait(20.0)


def started_with(stand_ins, program, *command):
    """Arguments that a program was started with by one of our executables."""
    graph, folder = stand_ins
    code, output = graph.run(sys.executable, SCRIPTS / command[0], *command[1:])
    assert code == 0, output
    return (folder / program).read_text().splitlines()


REMAPPINGS = ['__name:=this', 'scan:=front/scan', '__log:=/tmp/none.log']


def test_map_server_gets_the_trials_map(stand_ins):
    assert started_with(stand_ins, 'map_server', 'upstream_node', 'map_server', *REMAPPINGS) == [
        str(ROOT / 'worlds' / 'ros_logo.yaml'),
        *REMAPPINGS,
    ]


def test_amcl_starts_where_the_robot_does(stand_ins):
    assert started_with(stand_ins, 'amcl', 'upstream_node', 'amcl', *REMAPPINGS) == [
        '_initial_pose_x:=-3.4',
        '_initial_pose_y:=-0.85',
        '_initial_pose_a:=0.0',
        *REMAPPINGS,
    ]


def test_amcl_starts_where_the_users_file_says(stand_ins):
    graph, _ = stand_ins
    assert graph.run('rosparam', 'set', '/my_amcl', '{initial_pose_y: 1.0}')[0] == 0
    assert started_with(stand_ins, 'amcl', 'upstream_node', 'amcl', '__name:=my_amcl') == [
        '_initial_pose_x:=-3.4',
        '_initial_pose_a:=0.0',
        '__name:=my_amcl',
    ]


def test_upstreams_nodes_find_the_robots_settings_among_their_parameters(stand_ins):
    graph, _ = stand_ins
    # Of PyBullet's wheels it has nothing to warn of.
    code, settings = graph.run(sys.executable, SCRIPTS / 'robot_settings', 'burger', '--sim', 'pybullet')
    assert code == 0 and graph.run('rosparam', 'set', '/robot_settings', settings)[0] == 0
    assert graph.run('rosparam', 'set', '/my_base/local_costmap/width', '2.5')[0] == 0
    started_with(stand_ins, 'move_base', 'upstream_node', 'move_base', '__name:=my_base')
    costmap = yaml.safe_load(graph.run('rosparam', 'get', '/my_base/local_costmap')[1])
    assert costmap['width'] == 2.5 and costmap['robot_base_frame'] == 'base_footprint' and costmap['footprint']
    started_with(stand_ins, 'amcl', 'upstream_node', 'amcl', '__name:=other_amcl')
    assert graph.run('rosparam', 'get', '/other_amcl/base_frame_id')[1].strip() == 'base_footprint'
    assert started_with(stand_ins, 'spawn_model', 'gazebo_trial', 'spawn')[4] == 'burger'
    assert graph.run('rosparam', 'delete', '/robot_settings')[0] == 0


def test_gazebo_gets_the_trials_world(stand_ins):
    assert started_with(stand_ins, 'gzserver', 'gazebo_trial', 'server', *REMAPPINGS) == [
        '-u',
        '-e',
        'ode',
        str(ROOT / 'worlds' / 'ros_logo.world'),
        *REMAPPINGS,
    ]


def test_gazebo_gets_the_robot_at_the_trials_start(stand_ins):
    assert started_with(stand_ins, 'spawn_model', 'gazebo_trial', 'spawn') == [
        '-urdf',
        '-param',
        'gazebo_robot_description',
        '-model',
        'alto',
        '-x',
        '-3.4',
        '-y',
        '-0.85',
        '-Y',
        '0.0',
    ]


# --- a trial with nodes that behave as upstream's do -------------------------------------------------

VIEW = 'until rosparam get /trial > /dev/null 2>&1; do sleep 0.2; done; exec %s %s/trial_view_node'
LIST_TOPICS = """
import rosgraph, time
master = rosgraph.Master('/lister')
while True:
    try:
        print(*(topic for topic, _ in master.getSystemState()[0]), flush=True)
    except OSError:
        pass  # the master is not up yet, or not any more
    time.sleep(0.3)
"""


@pytest.fixture(scope='module')
def upstream_trial(tmp_path_factory):
    """(exit code, output, what is published, whether all processes went) of a trial of ours under upstream's names.

    move_base offers its action only when time runs. What rviz:=true starts is there, but for RViz itself.
    """
    require_ros()
    folder = tmp_path_factory.mktemp('upstream_trial')
    wait = DATA.parent / 'wait_for_clock.py'
    become = '#!/bin/sh\nexec %s %s/%s_node "$@"\n'
    programs = {name: {name: become % (sys.executable, SCRIPTS, name)} for name in UPSTREAM}
    programs['move_base']['move_base'] = programs['move_base']['move_base'].replace(
        'exec', f'{sys.executable} {wait} 1.0 || exit 1\nexec'
    )
    make_packages(folder / 'packages', {**programs, 'dwa_local_planner': {}})
    with Graph(folder / 'ros') as graph:
        add_packages(graph, folder / 'packages')
        launch = graph.launch(TRIAL, 'test:=%s' % (DATA / 'short_route.yaml'), 'nav:=upstream', 'rtf:=2', 'bag:=none')
        view = graph.start('sh', '-c', VIEW % (sys.executable, SCRIPTS))
        lister = graph.start(sys.executable, '-c', LIST_TOPICS)
        code = launch.wait()
        for other in (view, lister):
            other.send_signal(9)
        yield code, launch.output(), set(lister.output().split()), graph.is_gone(10.0)


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
