import numpy as np

from diff_encoder_sim.advice.answers import Budget, added, part_of


def test_parts_and_rest_add_up_to_what_is_found():
    rng = np.random.default_rng(1)
    one, other = rng.normal(1.0, 2.0, (4000, 3)), rng.normal(-3.0, 1.0, (4000, 3))
    budget = Budget({'one': part_of(one), 'other': part_of(other)}, part_of(one + other))
    parts = [*budget.parts.values(), budget.rest]
    np.testing.assert_allclose(sum(part.bias for part in parts), budget.found.bias, atol=1e-12)
    np.testing.assert_allclose(sum(part.variance for part in parts), budget.found.variance, atol=1e-12)
    assert np.all(np.abs(budget.rest.variance) < 0.2)  # independent causes leave none but by chance


def test_what_a_cause_adds_is_the_difference_of_pairs():
    rng = np.random.default_rng(2)
    without = rng.normal(0.5, 1.0, (3000, 3))
    part = added(without + rng.normal(0.1, 2.0, (3000, 3)), without)
    np.testing.assert_allclose(part.bias, 0.1, atol=0.15)
    np.testing.assert_allclose(part.variance, 4.0, rtol=0.15)
