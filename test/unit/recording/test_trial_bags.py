"""What trials have in common is in the bag of each, and encoded once."""

from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.trial_bag import TrialBag
from diff_encoder_sim.recording.trial_bags import TrialBags
from diff_encoder_sim.serialization.basic_messages import encode_clock


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
