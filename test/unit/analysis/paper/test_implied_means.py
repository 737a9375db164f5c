"""Means from a minimum, a maximum, a standard deviation and a per cent within."""

import numpy as np
import pytest

from diff_encoder_sim.analysis.paper.report_section import MeanEstimator

TOLERANCE, SCALE = 0.05, 0.06
REPETITIONS = 200
DRAWS = {'gaussian': lambda rng: rng.standard_normal(30), 'heavy tails': lambda rng: rng.standard_t(3, 30)}


@pytest.fixture(scope='module')
def estimator():
    return MeanEstimator()


def printed(values):
    """The statistics of a sample as the paper prints them."""
    return {
        'min': round(values.min(), 3),
        'max': round(values.max(), 3),
        'std': round(values.std(ddof=1), 3),
        'pct_within': round(100.0 * np.mean(np.abs(values) <= TOLERANCE), 1),
    }


@pytest.mark.heavy
@pytest.mark.parametrize('shape', DRAWS)
def test_intervals_cover_the_mean_at_the_nominal_rate(estimator, shape):
    rng = np.random.default_rng(7)
    means = rng.uniform(-0.15, 0.15, REPETITIONS)
    implied = [estimator.estimate(printed(mean + SCALE * DRAWS[shape](rng)), TOLERANCE) for mean in means]
    known = [(one, mean) for one, mean in zip(implied, means) if one is not None]
    assert len(known) > 0.95 * REPETITIONS
    assert 0.90 < np.mean([one.low <= mean <= one.high for one, mean in known]) < 0.99


@pytest.mark.heavy
def test_of_gaussian_samples_it_is_half_as_good_as_the_mean_itself(estimator):
    rng = np.random.default_rng(8)
    samples = 0.1 + SCALE * rng.standard_normal((REPETITIONS, 30))
    implied = [estimator.estimate(printed(sample), TOLERANCE) for sample in samples]
    errors = np.array([one.value - 0.1 for one in implied if one is not None])
    assert abs(errors.mean()) < 0.002
    assert SCALE / np.sqrt(30) < errors.std() < 2.0 * SCALE / np.sqrt(30)


def test_it_follows_a_shift_and_a_reflection(estimator):
    sample = {'min': -2.409, 'max': 0.557, 'std': 0.805, 'pct_within': 100.0}
    here = estimator.estimate(sample, 3.0)
    shifted = estimator.estimate({**sample, 'min': -1.409, 'max': 1.557}, 3.0)
    mirrored = estimator.estimate({**sample, 'min': -0.557, 'max': 2.409}, 3.0)
    assert shifted.value - here.value == pytest.approx(1.0, abs=0.001)
    assert -mirrored.value == pytest.approx(here.value, abs=0.02)


def test_the_number_within_tolerance_tells_on_which_side_most_values_are(estimator):
    sample = {'min': -0.114, 'max': 0.242, 'std': 0.068}
    off, central = (estimator.estimate({**sample, 'pct_within': pct}, TOLERANCE) for pct in (3.3, 60.0))
    assert off.low > central.value


def test_what_rounds_to_zero_has_a_mean_of_half_a_digit(estimator):
    implied = estimator.estimate({'min': -0.001, 'max': 0.0, 'std': 0.0, 'pct_within': 100.0}, TOLERANCE)
    assert -0.0015 < implied.low < implied.value < implied.high < 0.0005


def test_statistics_that_no_set_has_give_none(estimator):
    assert estimator.estimate({'min': -1.0, 'max': 1.0, 'std': 0.01, 'pct_within': 100.0}, TOLERANCE) is None
