"""Candidates of a campaign and the listed encoders."""

import math

import pytest

from advised_robots import REQUIREMENT, straight
from diff_encoder_sim.advice import odometry_study as module
from diff_encoder_sim.advice.answers import Answer, Criterion, Kind
from diff_encoder_sim.advice.odometry_study import candidates_of, equivalent_counts, listed_encoders, recommended
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from places import ROOT


def test_edges_out_of_place_are_worth_fewer_counts():
    params = EncoderParams.from_mapping({'ppr': 1000, 'encoder': {'edge_error': 0.3}}, 'test')
    # A reading has the variance 1/12 + 0.3^2 of a pulse.
    assert equivalent_counts(params) == pytest.approx(1000.0 * math.sqrt((1 / 12) / (1 / 12 + 0.09)))


def test_candidates_are_ordered_by_what_their_readings_are_worth():
    given = {'tests': ['SL'], 'encoders': ['as5047p', 'amt102', 'kobuki']}
    found = candidates_of(load_campaign('sweep', package_folder(), given))
    # 16384 counts with a non-linearity of a degree are worth fewer than Kobuki's 2578.
    assert [candidate.label for candidate in found] == ['16384 as5047p', '8192 amt102', '2578.33 kobuki']
    assert found[2].counts == pytest.approx(2578.33, abs=0.01) and found[0].counts < found[1].counts < 1000.0


@pytest.mark.parametrize(
    ('answer', 'label'),
    [
        (Answer(Criterion.ODOMETRY, Kind.FROM, 347.0, (20.0, 355.0)), '360'),  # at least 347 in closed form
        (Answer(Criterion.ODOMETRY, Kind.FROM, 347.0, (511.0, 600.0)), '512'),
        (Answer(Criterion.ODOMETRY, Kind.FROM, 700.0, (512.0, 700.0)), None),
        (Answer(Criterion.ODOMETRY, Kind.FROM, 500.0, (400.0, 510.0)), '512'),  # too few are not tried
        (Answer(Criterion.ODOMETRY, Kind.NOT_THE_LIMIT), None),
    ],
)
def test_a_candidate_is_recommended_where_counts_are_what_is_needed(answer, label):
    campaign = load_campaign('sweep', package_folder(), {'tests': ['SL'], 'ppr': [256.0, 360.0, 512.0]})
    found = recommended(candidates_of(campaign), answer, [straight()], REQUIREMENT)
    assert (found and found.label) == label


@pytest.fixture(scope='module')
def found():
    answers = {
        Criterion.POSE_ESTIMATE: Answer(Criterion.POSE_ESTIMATE, Kind.FROM, 100.0, (50.0, 100.0), '100'),
        Criterion.TRUTH: Answer(Criterion.TRUTH, Kind.NOT_THE_LIMIT),
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, 'LISTED_DRAWS', 100)
        listed = listed_encoders([straight()], ROOT / 'config', REQUIREMENT, answers)
    return {each.name: each for each in listed}


def test_the_catalogue_and_the_robots_are_in_it_sold_ones_first(found):
    assert {'amt102', 'hoverboard_hub', 'own of alto', 'own of burger'} <= set(found)
    places = [(each.is_of_robot, each.ppr) for each in found.values()]
    assert places == sorted(places) and {name for name, each in found.items() if each.is_of_robot and each.real} == {
        *('create2', 'duckiebot', 'kobuki')
    }


def test_odometry_is_judged_by_its_own_draws(found):
    assert found['own of burger'].meets[Criterion.ODOMETRY] is True
    assert found['own of alto'].meets[Criterion.ODOMETRY] is False
    # Its 16384 counts are off by a degree of the wheel.
    assert found['as5047p'].odometry_share.high < found['amt102'].odometry_share.low


def test_at_the_goal_encoders_are_judged_by_what_they_are_worth(found):
    meets = {name: each.meets[Criterion.POSE_ESTIMATE] for name, each in found.items()}
    assert (meets['sen_speed'], meets['own of alto'], meets['amt102']) == (False, None, True)
    assert not any(each.meets[Criterion.TRUTH] for each in found.values())
