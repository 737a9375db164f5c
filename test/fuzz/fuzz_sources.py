"""Drives without wheel angles, for reencode: odd ticks, speeds and poses in bags, odd tables, odd options."""

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.cli.reencode import main as reencode
from odd_values import ODD_WORDS, odd_float, odd_number, pick
from reencoding_drives import START_NS, TICK_NS, angles_rad, true_poses
from reencoding_sources import Bag, odometry

COUNT = 101
UNITS = ('ticks', 'ticks/message', 'rad', 'deg', 'rev', 'm', 'rad/s', 'deg/s', 'rpm', 'm/s')
SEPARATORS = (',', ';', '\t', ' ', '|')
CLOCK_STEPS_NS = (0, -TICK_NS, 10**9, -(10**9), 10**12, -START_NS, 10**18)


def warm_up(folder):
    path = odometry().write(folder / 'good.bag')
    _reencode(folder, [str(path), '--odom', '/odom'])


def run(rng, folder):
    pick(rng, (_of_bag, _of_bag, _of_table, _of_odometry))(rng, folder)


def _numbers(rng):
    """Stamps [ns] and both wheels' numbers, with a few odd ones."""
    stamps_ns = np.arange(COUNT) * TICK_NS + START_NS
    numbers = 100.0 * angles_rad(COUNT)
    for _ in range(int(rng.integers(0, 4))):
        at, side = int(rng.integers(COUNT)), int(rng.integers(2))
        if rng.random() < 0.5:
            numbers[at : at + int(rng.integers(1, 20)), side] = odd_float(rng, 100.0)
        else:
            stamps_ns[at:] += int(pick(rng, CLOCK_STEPS_NS))
    return np.clip(stamps_ns, 1, 2**31 * 10**9).tolist(), numbers.tolist()


def _of_bag(rng, folder):
    bag = Bag(is_ros2=bool(rng.random() < 0.3))
    is_one_topic = rng.random() < 0.4
    for stamp_ns, pair in zip(*_numbers(rng)):
        if is_one_topic:
            elements = pair[: int(pick(rng, (2, 2, 2, 2, 1, 0)))]
            bag.array('/both', stamp_ns, 'std_msgs/msg/Float64MultiArray', np.array(elements, float))
            continue
        for topic, number in zip(('/lwheel', '/rwheel'), pair):
            if rng.random() < 0.98:
                bag.add(topic, stamp_ns, 'std_msgs/msg/Float64', data=number)
    sides = ('/both[0]', '/both[1]') if is_one_topic else ('/lwheel', '/rwheel')
    path = bag.write(folder / ('odd' if bag.is_ros2 else 'odd.bag'))
    _reencode(folder, [str(path), '--ticks', *_odd_words(rng, sides), *_options(rng)])


def _of_table(rng, folder):
    separator = pick(rng, SEPARATORS)
    lines = ['time left right'.replace(' ', separator)]
    for stamp_ns, (left, right) in zip(*_numbers(rng)):
        cells = [str(stamp_ns / 1e9), repr(left), str(odd_number(rng, right) if rng.random() < 0.02 else right)]
        lines.append(separator.join(_odd_words(rng, cells, share=0.01)))
    path = folder / 'odd.csv'
    path.write_text('\n'.join(lines))
    columns = _odd_words(rng, ('time', 'left', pick(rng, ('right', '3', '2', '0'))))
    unit = pick(rng, ('s', 's', 'ms', 'us', 'ns'))
    _reencode(folder, ['--csv', str(path), '--columns', *columns, '--time-unit', unit, *_options(rng)])


def _of_odometry(rng, folder):
    poses = true_poses(angles_rad(COUNT))
    for _ in range(int(rng.integers(0, 4))):
        at = int(rng.integers(COUNT))
        poses[at] = Pose2D(odd_float(rng), poses[at].y_m, poses[at].yaw_rad)
    path = odometry(poses=poses).write(folder / 'odd.bag')
    (topic,) = _odd_words(rng, ['/odom'])
    _reencode(folder, [str(path), '--odom', topic])


def _options(rng):
    unit = pick(rng, UNITS)
    options = ['--unit', unit]
    if unit.startswith('ticks') and rng.random() < 0.95:
        options.append(f'--ticks-per-revolution={odd_number(rng, 360) if rng.random() < 0.2 else 360}')
    if rng.random() < 0.1:
        options += ['--ticks-modulus', pick(rng, ('65536', '2', '0'))]
    return options + (['--reversed', 'left', 'right'] if rng.random() < 0.1 else [])


def _odd_words(rng, words, share=0.03):
    """The words, of which a few are odd ones that argparse takes for no option."""
    return [f'_{pick(rng, ODD_WORDS)}' if rng.random() < share else word for word in words]


def _reencode(folder, arguments):
    reencode([*arguments, '--ppr', '40', '1024', '--out', str(folder / 'what_if')])
