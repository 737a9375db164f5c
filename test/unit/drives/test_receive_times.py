"""Mean and jitter of times of receipt."""

import numpy as np

from diff_encoder_sim.drives.field_wheels import ReceiveTimes, receive_times_note


def times(topic, stamps_ns):
    made = ReceiveTimes(topic)
    for stamp_ns in stamps_ns:
        made.add(int(stamp_ns))
    return made


def test_mean_and_deviation_are_those_of_the_intervals():
    rng = np.random.default_rng(3)
    intervals_ns = rng.normal(50e6, 4e6, 20_000).astype(np.int64)
    text = times('/lwheel', 10**18 + np.cumsum(intervals_ns)).text()
    assert text == f'/lwheel every {1e-6 * intervals_ns[1:].mean():.1f} ms +- {1e-6 * intervals_ns[1:].std():.1f} ms'


def test_all_topics_are_in_one_line():
    note = receive_times_note([times('/a', [5]), times('/b', [0, 10**7, 3 * 10**7])])
    assert '/a every 0.0 ms +- 0.0 ms and /b every 15.0 ms +- 5.0 ms' in note and '\n' not in note
