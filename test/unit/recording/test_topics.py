"""The topics of a trial."""

from diff_encoder_sim.recording.topics import RECORDED, TOPIC_OF_SOURCE
from diff_encoder_sim.trials.pose_source import PoseSource


def test_every_pose_source_has_a_recorded_topic_of_its_own():
    assert list(TOPIC_OF_SOURCE) == list(PoseSource)
    assert set(TOPIC_OF_SOURCE.values()) < set(RECORDED) and len(set(TOPIC_OF_SOURCE.values())) == len(PoseSource)
