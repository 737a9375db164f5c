"""The signed-rank distribution against enumeration of all signs."""

import itertools

import numpy as np
import pytest

from diff_encoder_sim.analysis.paired_statistics import MOST_PAIRS_EXACT, means_beyond_interval, signed_rank_p


@pytest.mark.parametrize('differences', [(1.0, 2.0, -3.0, 4.0), (1.0, 1.0, -1.0, 2.0, 2.0), (0.0, -5.0, 5.0, 5.0)])
def test_p_value_by_all_signs(differences):
    values = np.array(differences)
    sizes = np.abs(values[values != 0.0])
    ranks = np.array([np.sum(sizes < size) + 0.5 * (np.sum(sizes == size) + 1) for size in sizes])
    found = abs(np.sum(np.sign(values[values != 0.0]) * ranks))
    sums = [abs(np.dot(signs, ranks)) for signs in itertools.product((-1, 1), repeat=len(ranks))]
    assert signed_rank_p(values) == pytest.approx(np.mean(np.array(sums) >= found - 1e-9))


def test_no_difference_at_all():
    assert signed_rank_p(np.zeros(5)) == 1.0


def test_many_pairs_go_over_into_the_normal_distribution():
    rng = np.random.default_rng(2)
    values = rng.normal(0.15, 1.0, MOST_PAIRS_EXACT)
    exact = signed_rank_p(values)
    assert signed_rank_p(np.append(values, 1e-9)) == pytest.approx(exact, abs=0.02)


def test_means_beyond_the_interval():
    assert means_beyond_interval(5, 0.95) == 0  # 2 of 32 are too many
    assert means_beyond_interval(6, 0.95) == 1
    exact, normal = means_beyond_interval(MOST_PAIRS_EXACT, 0.95), means_beyond_interval(MOST_PAIRS_EXACT + 1, 0.95)
    assert 0 < normal - exact < 60
