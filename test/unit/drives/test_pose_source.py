"""The sources of poses."""

from diff_encoder_sim.drives.topics import PoseSource


def test_names_and_order_are_those_of_trials_csv():
    assert [source.value for source in PoseSource] == ['odom', 'amcl', 'global', 'world']
