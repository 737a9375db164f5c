"""What could serve where a bag has no wheel angles."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.serving_topics import serving_options
from reencoding_drives import ROS1, drive, write_ros1
from reencoding_sources import Bag, arrays, create3, duckietown, jackal, kobuki, odometry, turtlebot3, two_topics

VELOCITY = "'/feedback.drivers[{}].measured_velocity'"
N = '--ticks-per-revolution N'


def options_of(path):
    with open_source(path) as source:
        return serving_options(path, source)


@pytest.mark.parametrize(
    ('make', 'options'),
    [
        (lambda: two_topics(360), [f'--ticks /lwheel /rwheel {N}']),
        (arrays, [f"--ticks '/encoders[0]' '/encoders[1]' {N}"]),
        (kobuki, [f'--ticks /mobile_base/sensors/core.left_encoder /mobile_base/sensors/core.right_encoder {N}']),
        (lambda: turtlebot3(True), [f'--ticks /sensor_state.left_encoder /sensor_state.right_encoder {N}']),
        (duckietown, [f'--ticks /duck/left_wheel_encoder_node/tick /duck/right_wheel_encoder_node/tick {N}']),
        (create3, [f'--ticks /wheel_ticks.ticks_left /wheel_ticks.ticks_right {N}']),
        (
            jackal,
            [
                "--ticks '/feedback.drivers[0].measured_travel' '/feedback.drivers[1].measured_travel' --unit rad",
                f'--ticks {VELOCITY.format(0)} {VELOCITY.format(1)} --unit rad/s',
            ],
        ),
        (odometry, ['--odom /odom']),
    ],
)
def test_options_are_listed(tmp_path, make, options):
    bag = make()
    assert options_of(bag.write(tmp_path / ('a' if bag.is_ros2 else 'a.bag'))) == options


def test_the_likeliest_comes_first_and_other_numbers_are_left_out(tmp_path):
    bag = odometry()
    bag.rows += jackal().rows + two_topics(360).rows
    for time_ns in (1, 2):
        for side in ('left', 'right'):
            bag.add(f'/{side}/battery', time_ns, 'std_msgs/msg/Float32', data=1.0)
            bag.add(f'/cmd_{side}_wheel', time_ns, 'std_msgs/msg/Float32', data=1.0)
        bag.array('/ranges', time_ns, 'std_msgs/msg/Float32MultiArray', np.zeros(2, np.float32))
    options = options_of(bag.write(tmp_path / 'a.bag'))
    assert [option.split()[1].strip("'") for option in options] == [
        '/lwheel',
        '/feedback.drivers[0].measured_travel',
        '/feedback.drivers[0].measured_velocity',
        '/odom',
    ]


def test_transforms_serve_where_there_is_no_odometry(tmp_path):
    transform = ROS1.tf(ROS1.transform(5, IDENTITY, 'odom', 'base_link'))
    path = write_ros1(tmp_path / 'a.bag', [('/tf', 5, transform)])
    assert options_of(path) == ["--odom 'odom->base_link'"]


def test_poses_and_lasers_do_not_serve(tmp_path):
    assert options_of(write_ros1(tmp_path / 'a.bag', drive()[1:2])) == []
    bag = Bag()
    bag.add('/text', 1, 'std_msgs/msg/String', data='left_encoder')
    assert options_of(bag.write(tmp_path / 'b.bag')) == []
