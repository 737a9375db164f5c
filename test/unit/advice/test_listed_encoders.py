import pytest

from advised_robots import REQUIREMENT, alto, straight
from diff_encoder_sim.advice import listed_encoders as module
from diff_encoder_sim.advice.answers import Answer, Criterion, Kind
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.listed_encoders import listed_encoders
from places import ROOT


@pytest.fixture(scope='module')
def found():
    answers = {
        Criterion.POSE_ESTIMATE: Answer(Criterion.POSE_ESTIMATE, Kind.FROM, 100.0, (50.0, 100.0), '100'),
        Criterion.TRUTH: Answer(Criterion.TRUTH, Kind.NOT_THE_LIMIT),
    }
    kept, module.LISTED_DRAWS = module.LISTED_DRAWS, 100
    try:
        tests = [DriveDraws(straight(), alto(), 1)]
        return {each.name: each for each in listed_encoders(tests, ROOT / 'config', REQUIREMENT, answers)}
    finally:
        module.LISTED_DRAWS = kept


def test_the_catalogue_and_the_robots_are_in_it_by_ascending_counts(found):
    assert {'amt102', 'hoverboard_hub', 'own of alto', 'own of burger'} <= set(found)
    assert [each.counts for each in found.values()] == sorted(each.counts for each in found.values())


def test_odometry_is_judged_by_its_own_draws(found):
    assert found['own of burger'].meets[Criterion.ODOMETRY] is True
    assert found['own of alto'].meets[Criterion.ODOMETRY] is False
    # Its 16384 counts are off by a degree of the wheel.
    assert found['as5047p'].share.high < found['amt102'].share.low


def test_at_the_goal_encoders_are_judged_by_what_they_are_worth(found):
    meets = {name: each.meets[Criterion.POSE_ESTIMATE] for name, each in found.items()}
    assert (meets['sen_speed'], meets['own of alto'], meets['amt102']) == (False, None, True)
    assert not any(each.meets[Criterion.TRUTH] for each in found.values())
