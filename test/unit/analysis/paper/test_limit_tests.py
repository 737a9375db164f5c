"""Errors against a limit, by intervals worked out by hand."""

import numpy as np

from diff_encoder_sim.analysis.paper.claims import Conclusion, Sample, fractions_within, spreads
from diff_encoder_sim.analysis.quantities import YAW, X

HOLDS, FAILS, UNCLEAR = Conclusion.HOLDS, Conclusion.FAILS, Conclusion.UNCLEAR


def conclusions(tests):
    return [test.conclusion for test in tests]


def exact(count, spread):
    """Values of exactly this standard deviation."""
    values = np.linspace(-1.0, 1.0, count)
    return spread * values / values.std(ddof=1)


def test_spread_against_a_limit():
    # Thirty values: the 95 % interval of a spread of 1 is 0.796 to 1.344.
    one = [Sample('', exact(30, 1.0), YAW)]
    assert conclusions(spreads(0.79, above=one)) == [HOLDS]
    assert conclusions(spreads(0.81, above=one)) == [UNCLEAR]
    assert conclusions(spreads(1.35, above=one)) == [FAILS]
    assert conclusions(spreads(1.35, below=one)) == [HOLDS]
    assert conclusions(spreads(0.79, below=one)) == [FAILS]
    assert conclusions(spreads(1.0, below=[Sample('', np.array([0.5]), YAW)])) == [UNCLEAR]


def test_failing_must_be_sure_for_all_parts_together():
    samples = [Sample('', exact(30, 1.0), YAW)]
    assert conclusions(spreads(1.36, above=samples)) == [FAILS]
    assert conclusions(spreads(1.36, above=20 * samples)) == 20 * [UNCLEAR]


def test_fraction_against_a_limit():
    # 30 of 30: 88.6 to 100 per cent.
    all_of_them = [Sample('', np.zeros(30), X)]
    assert conclusions(fractions_within(0.88, above=all_of_them)) == [HOLDS]
    assert conclusions(fractions_within(0.89, above=all_of_them)) == [UNCLEAR]
    assert conclusions(fractions_within(0.88, below=all_of_them)) == [FAILS]
    assert '30 of 30 within, 95 % interval 89 to 100 %' in fractions_within(0.9, above=all_of_them)[0].text
