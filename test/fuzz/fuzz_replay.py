"""replay.launch with odd arguments and odd bags, on a real ROS graph: where the workspace is sourced."""

import re

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from fuzz_bags import COUNT, odd_row
from launched_graph import ROOT, Graph
from odd_values import ODD_NUMBERS, pick
from reencoding_drives import ROS1, START_NS, TICK_NS, angles_rad, drive, write_ros1
from sandbox import Fault

REPLAY = ROOT / 'launch' / 'replay.launch'
TEXTS = (
    '',
    ' ',
    'nan',
    "it's",
    '"',
    '$(arg bag)',
    '$(find nobody)',
    'a b',
    'ä',
    '/dev/null',
    '.',
    '; touch oops',
    '{',
    '[1, 2]',
    '-1',
)
ODD = {
    'ppr': (*ODD_NUMBERS, *TEXTS, '{left: 90}', '{left: 40, right: 1024}', 'true'),
    'speed': (*ODD_NUMBERS, *TEXTS, 50, 100, 101),
    'left': (*TEXTS, 'right_wheel_joint', 'left_wheel_joint'),
    'right': (*TEXTS, 'left_wheel_joint'),
    'joint_states': (*TEXTS, '/joint_states', '/odom', 'joint_states', '/' * 300),
    'out': (*TEXTS, '/proc/1/new.bag', 'new.bag', 'x' * 300),
    'robot': (*TEXTS, 'burger', 'nobody', 'alto'),
    'robot_args': (*TEXTS, 'a=1', '=', 'a:=1'),
    'config': (*TEXTS, '/dev/zero', str(ROOT / 'config' / 'amcl.yaml')),
    'bag': TEXTS,
}
WAIT_S = 90.0


def run(rng, folder):
    bag = write_ros1(folder / 'drive.bag', _odd_rows(rng))
    arguments = {'bag': str(bag), 'speed': '20'}
    for _ in range(int(rng.integers(0, 3))):
        name = pick(rng, sorted(ODD))
        arguments[name] = str(pick(rng, ODD[name]))[:400]
    with Graph(folder / 'ros') as graph:
        launch = graph.launch(REPLAY, *(f'{name}:={value}' for name, value in arguments.items()))
        code = launch.wait(WAIT_S)
        output = launch.output()
        is_gone = graph.is_gone(10.0)
    if 'Traceback (most recent call last)' in output or not is_gone:
        raise Fault(f'{"" if is_gone else "processes are left: "}{arguments}: {output}')
    if code != 0:
        raise ConfigError(_naming_line(output))


def _naming_line(output):
    """The line of whoever refuses: a node, robot_settings before any starts, or roslaunch itself."""
    for line in output.splitlines():
        if any(word in line for word in ('FATAL', 'robot_settings: ', 'RLException', 'Invalid ')):
            return re.sub(r'\x1b\[[0-9;]*m', '', line)
    raise Fault(f'it fails without a word: {output}')


def _odd_rows(rng):
    """A second of a drive; in half of the cases with a step of the clock, or with odd messages."""
    rows = drive(ROS1, COUNT)
    if rng.random() < 0.5:
        return rows
    at, step_ns = int(rng.integers(COUNT)), int(pick(rng, (-TICK_NS, -(10**9), 10**9, 3 * 10**9, -START_NS)))
    stamps_ns = START_NS + np.arange(COUNT) * TICK_NS
    stamps_ns[at:] += step_ns
    stamped = zip(np.maximum(stamps_ns, 1).tolist(), angles_rad(COUNT))
    return [odd_row(rng, ('/joint_states', stamp, ROS1.joint_state(stamp, angles))) for stamp, angles in stamped]
