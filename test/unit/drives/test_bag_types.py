"""Types that a bag defines, or does not."""

import pytest

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.message_fields import message_type
from reencoding_sources import Bag, jackal, kobuki


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


def test_a_type_whose_parts_nobody_defines_is_named(tmp_path):
    path = jackal().write(tmp_path / 'a.bag')
    path.write_bytes(path.read_bytes().replace(b'MSG: jackal_msgs/DriveFeedback', b'MSG: jackal_msgs/OtherFeedback'))
    with open_source(path) as source, pytest.raises(ConfigError, match='which the bag does not define'):
        message_type(path, source, '/feedback')


def test_a_type_of_ros_needs_no_definition(tmp_path):
    bag = Bag()
    bag.add('/lwheel', 10**9, 'std_msgs/msg/Int16', data=-3)
    path = without_definitions(bag.write(tmp_path / 'a.bag'))
    with open_source(path) as source:
        found = message_type(path, source, '/lwheel')
        assert found.decode(next(iter(source.messages(('/lwheel',)))).raw).data == -3


@pytest.mark.parametrize('is_ros2', [False, True])
def test_a_torn_message_is_dropped(tmp_path, is_ros2):
    path = kobuki(is_ros2).write(tmp_path / ('a' if is_ros2 else 'a.bag'))
    with open_source(path) as source:
        found = message_type(path, source, '/mobile_base/sensors/core')
        raw = next(iter(source.messages(tuple(source.topics)))).raw
    assert found.decode(raw).left_encoder > 0
    for size in range(len(raw)):
        with pytest.raises(InputFault, match='torn'):
            found.decode(raw[:size])
