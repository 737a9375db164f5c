"""Wheel angles from any two numbers of messages: finding, listing and pairing them."""

import shlex

import numpy as np
import pytest

import reencoding_sources as sources
from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.field_wheels import find_field, serving_options
from reencoding_drives import ROS1, TICK_NS, angles_rad, counts_of, run, samples_of, write
from reencoding_sources import COUNT, Bag, arrays, jackal, kobuki, odometry, turtlebot3, two_topics

TICKS = '--ticks-per-revolution'
N = f' {TICKS} N'


def options_of(path):
    return serving_options(open_source(path))


def reencoded(tmp_path, bag, arguments, ppr=64):
    """The counts in the re-encoded bag."""
    run(bag.write(tmp_path / 'a'), *arguments, '--ppr', ppr, '--draws', 0, '--out', tmp_path / 'out')
    return counts_of(tmp_path / 'out' / f'a_{ppr}ppr.bag')


def expected_counts(ppr=64):
    return [list(sample[1:3]) for sample in samples_of(angles_rad(COUNT), ppr)]


@pytest.mark.parametrize(
    ('make', 'sides', 'recorded_ppr'),
    [
        (lambda: two_topics(1024), ['/lwheel', '/rwheel'], 1024),
        (lambda: two_topics(1024, 'std_msgs/msg/Float64', 0), ['/lwheel', '/rwheel'], 1024),
        (arrays, ['/encoders[0]', '/encoders[1]'], 1000),
        (lambda: arrays('Int16', np.int16, is_ros2=True), ['/encoders[0]', '/encoders[1]'], 1000),
        (turtlebot3, ['/sensor_state.left_encoder', '/sensor_state.right_encoder'], 4096),
        (sources.duckietown, [f'/duck/{side}_wheel_encoder_node/tick' for side in ('left', 'right')], 135),
        (sources.create3, ['/wheel_ticks.ticks_left', '/wheel_ticks.ticks_right'], 508.8),
    ],
)
def test_ticks_are_listed_and_give_the_counts_of_a_coarser_encoder(tmp_path, make, sides, recorded_ppr):
    differences = np.subtract(reencoded(tmp_path, make(), ['--ticks', *sides, TICKS, recorded_ppr]), expected_counts())
    assert options_of(tmp_path / 'a') == ['--ticks ' + ' '.join(map(shlex.quote, sides)) + N]
    assert recorded_ppr % 64 or not differences.any()
    # Otherwise a quarter of 64 / recorded of the counts may be one off.
    assert np.abs(differences).max() <= 1
    assert np.count_nonzero(differences) <= 2.0 * 0.25 * 64 / recorded_ppr * differences.size


@pytest.mark.parametrize('is_ros2', [False, True])
def test_travel_gives_the_counts_of_any_encoder(tmp_path, is_ros2):
    sides = ['/feedback.drivers[0].measured_travel', '/feedback.drivers[1].measured_travel']
    found = reencoded(tmp_path, jackal(is_ros2), ['--ticks', *sides, '--unit', 'rad'], ppr=1000)
    assert found == expected_counts(1000)


@pytest.mark.parametrize('is_ros2', [False, True])
def test_a_counter_of_16_bits_is_unwrapped(tmp_path, is_ros2):
    sides = ['/mobile_base/sensors/core.left_encoder', '/mobile_base/sensors/core.right_encoder']
    bag = kobuki(is_ros2)
    shown = [message.left_encoder for _, _, message in bag.rows]
    assert min(shown) < 1000 and max(shown) > 64_000  # it wraps on the way
    found = np.array(reencoded(tmp_path, bag, ['--ticks', *sides, '--robot', 'kobuki'], ppr=90))
    travelled = np.floor(np.outer(np.arange(251) * 0.02, (4.0, 4.4)) * 90 / (2.0 * np.pi))
    assert found.shape == travelled.shape  # Kobuki reports at 50 Hz
    assert np.abs(found - found[0] - travelled).max() <= 1


def test_a_given_modulus_overrides_the_width_of_the_field(tmp_path):
    bag = two_topics(1024, 'std_msgs/msg/Int32', 1000)
    sides = ['--ticks', 'lwheel.data', 'rwheel', TICKS, 1024, '--ticks-modulus', 1000]
    assert reencoded(tmp_path, bag, sides) == expected_counts()


@pytest.mark.parametrize('modulus', [256, 1000, 65536])
def test_a_counter_that_wraps_at_an_unknown_number_is_an_error(tmp_path, modulus):
    ppr = modulus // 4
    arguments = ['--ticks', 'lwheel.data', 'rwheel', TICKS, ppr]
    says = r'a: given a (left|right) wheel whose counts step by -\d+ at .*allowed: --ticks-modulus'
    with pytest.raises(SystemExit, match=says):
        reencoded(tmp_path, two_topics(ppr, 'std_msgs/msg/Int32', modulus), arguments)


@pytest.mark.parametrize('is_unset', [False, True])
def test_stamps_are_those_of_the_headers_or_of_receipt(tmp_path, capsys, is_unset):
    """A topic whose header is never set is stamped by the recorder, with one note."""
    bag = turtlebot3()
    for row, (topic, time_ns, message) in enumerate(bag.rows):
        if is_unset:
            message.header.stamp.sec = message.header.stamp.nanosec = 0
        else:
            bag.rows[row] = topic, time_ns + 3 * TICK_NS, message
    sides = ['--ticks', '/sensor_state.left_encoder', '/sensor_state.right_encoder', TICKS, 4096]
    assert reencoded(tmp_path, bag, sides) == expected_counts()
    error = capsys.readouterr().err
    assert error.count('no stamps on /sensor_state: using the times of receipt') == is_unset


@pytest.fixture(scope='module', params=[False, True], ids=['ROS 1', 'ROS 2'])
def source(tmp_path_factory, request):
    bag = Bag(request.param)
    for part in (kobuki, jackal, odometry):
        bag.rows += part(request.param).rows[:3]
    bag.array('/pair', 10**9, 'std_msgs/msg/Int32MultiArray', np.array([7, -8], np.int32))
    bag.array('/bad', 10**9, 'std_msgs/msg/Float64MultiArray', np.array([np.nan, np.inf]))
    bag.add('/count', 10**9, 'std_msgs/msg/Int64', data=2**62)
    bag.add('/text', 10**9, 'std_msgs/msg/String', data='7')
    return open_source(bag.write(tmp_path_factory.mktemp('bag') / 'a'))


def first_value(source, given):
    field = find_field(source, '--ticks', given)
    message = next(iter(source.messages((field.topic,))))
    return field, field.value(field.decode(message.raw))


@pytest.mark.parametrize(
    ('given', 'name', 'value', 'bits'),
    [
        ('count.data', '/count', 2**62, None),
        ('/pair[1]', '/pair[1]', -8, 32),
        ('/mobile_base/sensors/core.left_encoder', '/mobile_base/sensors/core.left_encoder', 64835, 16),
        ('/feedback.drivers[1].measured_velocity', '/feedback.drivers[1].measured_velocity', np.float32(4.4), None),
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
        ('/count.x', 'no number of std_msgs/msg/Int64; allowed: /count'),
        ('/text', 'no number of std_msgs/msg/String; allowed: it has no numbers'),
        ('/pair', r'allowed: .*/pair\[0\], /pair\[1\]'),
        ('/feedback.drivers[2]', r'allowed: .*/feedback.drivers\[1\].measured_travel'),
    ],
)
def test_other_fields_are_refused_with_a_list_of_numbers(source, given, complaint):
    with pytest.raises(ConfigError, match=complaint) as caught:
        find_field(source, '--ticks', given)
    assert str(caught.value).startswith(f'{source.path}: --ticks: given ') and '\n' not in str(caught.value)


@pytest.mark.parametrize(('given', 'complaint'), [('/pair[2]', '2 elements'), ('/bad[0]', 'nan'), ('/bad[1]', 'inf')])
def test_a_message_without_the_number_is_dropped(source, given, complaint):
    with pytest.raises(InputFault, match=complaint):
        first_value(source, given)


def test_an_undefined_type_is_named(tmp_path):
    path = kobuki().write(tmp_path / 'a.bag')
    content = path.read_bytes()
    for text in (b'Header header', b'uint16'):  # as by recorders without the type
        content = content.replace(text, b'?' * len(text))
    path.write_bytes(content)
    with pytest.raises(ConfigError, match='which the bag does not define'):
        find_field(open_source(path), '--ticks', '/mobile_base/sensors/core.left_encoder')


def test_the_likeliest_option_is_first_and_other_numbers_are_left_out(tmp_path):
    bag = odometry()
    bag.rows += jackal().rows + two_topics(360).rows
    for side in ('left', 'right'):
        bag.add(f'/{side}/battery', 1, 'std_msgs/msg/Float32', data=1.0)
        bag.add(f'/cmd_{side}_wheel', 1, 'std_msgs/msg/Float32', data=1.0)
    bag.array('/ranges', 1, 'std_msgs/msg/Float32MultiArray', np.zeros(2, np.float32))
    drivers = [
        f"--ticks '/feedback.drivers[0].{field}' '/feedback.drivers[1].{field}' --unit {unit}"
        for field, unit in (('measured_travel', 'rad'), ('measured_velocity', 'rad/s'))
    ]
    assert options_of(bag.write(tmp_path / 'a')) == [f'--ticks /lwheel /rwheel{N}', *drivers, '--odom /odom']


def test_transforms_replace_odometry(tmp_path):
    transform = ROS1.tf(ROS1.transform(5, IDENTITY, 'odom', 'base_link'))
    assert options_of(write(tmp_path / 'a', [('/tf', 5, transform)])) == ["--odom 'odom->base_link'"]
