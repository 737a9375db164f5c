"""Types that a bag defines, or does not, and numbers in messages by their names."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.field_wheels import find_field, message_type, serving_options
from reencoding_drives import ROS1, write_ros1
from reencoding_sources import Bag, arrays, create3, duckietown, jackal, kobuki, odometry, turtlebot3, two_topics


@pytest.fixture(scope='module', params=[False, True], ids=['ROS 1', 'ROS 2'])
def source(tmp_path_factory, request):
    bag = Bag(request.param)
    for part in (kobuki, jackal, odometry, turtlebot3):
        bag.rows += part(request.param).rows[:3]
    bag.array('/pair', 10**9, 'std_msgs/msg/Int32MultiArray', np.array([7, -8], np.int32))
    bag.array('/bad', 10**9, 'std_msgs/msg/Float64MultiArray', np.array([np.nan, np.inf]))
    bag.add('/count', 10**9, 'std_msgs/msg/Int64', data=2**62)
    bag.add('/text', 10**9, 'std_msgs/msg/String', data='7')
    with open_source(bag.write(tmp_path_factory.mktemp('bag') / ('a' if request.param else 'a.bag'))) as opened:
        yield opened


def first_value(source, given):
    field = find_field('a.bag', source, '--ticks', given)
    message = next(iter(source.messages((field.topic,))))
    return field, field.value(field.message.decode(message.raw))


@pytest.mark.parametrize(
    ('given', 'name', 'value', 'bits'),
    [
        ('/count', '/count', 2**62, None),
        ('count.data', '/count', 2**62, None),
        ('/pair[1]', '/pair[1]', -8, 32),
        ('/pair.data[0]', '/pair[0]', 7, 32),
        ('/mobile_base/sensors/core.left_encoder', '/mobile_base/sensors/core.left_encoder', 64835, 16),
        ('/feedback.drivers[1].measured_velocity', '/feedback.drivers[1].measured_velocity', np.float32(4.4), None),
        ('/odom.pose.pose.orientation.w', '/odom.pose.pose.orientation.w', 1.0, None),
        ('/odom.pose.covariance[35]', '/odom.pose.covariance[35]', 0.0, None),
    ],
)
def test_a_number_is_found(source, given, name, value, bits):
    field, found = first_value(source, given)
    assert (field.name, found, field.bits) == (name, value, bits)


@pytest.mark.parametrize(
    ('given', 'complaint'),
    [
        ('/cont', 'given /cont; allowed: TOPIC or TOPIC.field.* of its topics /bad, /count'),
        ('/count[', 'given /count.; allowed: TOPIC'),
        ('/count.x', 'no number of std_msgs/msg/Int64; allowed: /count'),
        ('/text', 'no number of std_msgs/msg/String; allowed: it has no numbers'),
        ('/pair', r'allowed: .*/pair\[0\], /pair\[1\]'),
        ('/feedback.drivers[2].measured_travel', r'allowed: .*/feedback.drivers\[1\].measured_travel'),
        ('/feedback.drivers.measured_travel', r'allowed: /feedback.drivers\[0\].current'),
    ],
)
def test_what_is_no_number_is_refused_and_those_that_are_are_listed(source, given, complaint):
    with pytest.raises(ConfigError, match=complaint) as caught:
        find_field('a.bag', source, '--ticks', given)
    assert str(caught.value).startswith('a.bag: --ticks: given ') and '\n' not in str(caught.value)


@pytest.mark.parametrize(('given', 'complaint'), [('/pair[2]', '2 elements'), ('/bad[0]', 'nan'), ('/bad[1]', 'inf')])
def test_a_message_without_the_number_is_dropped(source, given, complaint):
    with pytest.raises(InputFault, match=complaint):
        first_value(source, given)


def without_definitions(path):
    """As recorders leave them that do not know a type."""
    content = path.read_bytes()
    for text in (b'Header header', b'uint16', b'int16 data'):
        content = content.replace(text, b'?' * len(text))
    path.write_bytes(content)
    return path


def test_a_type_that_nobody_defines_is_named(tmp_path):
    path = without_definitions(kobuki().write(tmp_path / 'a.bag'))
    with open_source(path) as source, pytest.raises(ConfigError, match='which the bag does not define') as caught:
        message_type(path, source, '/mobile_base/sensors/core')
    assert 'kobuki_msgs/msg/SensorState' in str(caught.value)


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
