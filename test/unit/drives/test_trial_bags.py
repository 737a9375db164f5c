"""What trials have in common is in the bag of each, and encoded once."""

import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.pose_messages import encode_pose_stamped
from diff_encoder_sim.drives.sensor_messages import encode_clock
from diff_encoder_sim.drives.trial_bag import TrialBag, TrialBags


def test_each_bag_is_as_if_it_were_written_alone(tmp_path):
    encoded = []

    def encode(stamp_ns):
        encoded.append(stamp_ns)
        return encode_clock(stamp_ns)

    with TrialBag(tmp_path / 'a.bag', 'full') as first, TrialBag(tmp_path / 'b.bag', 'full') as second:
        both = TrialBags([first, second])
        for time_ns in (10, 20):
            both.publish(topics.CLOCK, topics.SIMULATOR_NODE, time_ns, encode, time_ns)
        assert both.wants(topics.CLOCK) and not both.wants('/clocks')
    assert encoded == [10, 20]
    with TrialBag(tmp_path / 'alone.bag', 'full') as alone:
        for time_ns in (10, 20):
            alone.write(topics.CLOCK, topics.SIMULATOR_NODE, encode_clock(time_ns), time_ns)
    contents = {(tmp_path / name).read_bytes() for name in ('a.bag', 'b.bag', 'alone.bag')}
    assert len(contents) == 1


@pytest.mark.parametrize('own_each', [1, 7])
@pytest.mark.parametrize('bag_format', ['ros1', 'mcap'])
def test_own_messages_stand_between_common_ones_however_many_wait(tmp_path, own_each, bag_format):
    """Of either kind more are published than wait to be written at once."""

    def drive(own_bags, common):
        for tick in range(1, 2500):
            time_ns = 10**7 * tick
            common.publish(topics.CLOCK, topics.SIMULATOR_NODE, time_ns, encode_clock, time_ns)
            if tick > 30:  # its description comes late
                common.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, time_ns, encode_pose_stamped, *pose(tick))
            for bag in own_bags:
                for _ in range(own_each):
                    bag.publish(topics.GLOBAL_POSE, topics.GLOBAL_POSE_NODE, time_ns, encode_pose_stamped, *pose(tick))

    def pose(tick):
        return Pose2D(0.01 * tick, 0.0, 0.0), 10**7 * tick, 'map'

    with TrialBag(tmp_path / 'a', 'full', bag_format) as first, TrialBag(tmp_path / 'b', 'full', bag_format) as second:
        drive([first, second], TrialBags([first, second]))
    with TrialBag(tmp_path / 'alone', 'full', bag_format) as alone:
        drive([alone], alone)
    contents = {(tmp_path / name).read_bytes() for name in ('a', 'b', 'alone')}
    assert len(contents) == 1
