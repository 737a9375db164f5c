"""The errata, against the paper's numbers."""

import math

import pytest

from diff_encoder_sim.analysis.paper.paper_cells import ERRATA, errata_of, load_paper_cells
from diff_encoder_sim.drives.topics import PoseSource


@pytest.fixture(scope='module')
def printed():
    return {(one.source, one.test, one.ppr, one.quantity.name, one.statistic): one for one in load_paper_cells()}


def test_the_repeated_column_is_marked_and_is_repeated(printed):
    affected = [one for one in printed.values() if 'smt_column_twice' in errata_of(one)]
    assert len(affected) == 24
    for one in affected:
        assert (
            one.ppr == '1024' and one.value == printed[one.source, 'SMT', '90', one.quantity.name, one.statistic].value
        )


def test_one_trial_makes_the_spread_at_40_ppr(printed):
    for source in (PoseSource.ODOM, PoseSource.WORLD, PoseSource.GLOBAL):
        most = printed[source, 'SMT', '40', 'yaw_deg', 'max'].value
        spread = printed[source, 'SMT', '40', 'yaw_deg', 'std'].value
        assert spread == pytest.approx(most / math.sqrt(30), rel=0.05)
        assert errata_of(printed[source, 'SMT', '40', 'yaw_deg', 'std']) == ['smt_outlier_40']
        assert errata_of(printed[source, 'SMT', '40', 'x_m', 'std']) == []


def test_errata_have_keys_of_their_own():
    assert len({erratum.key for erratum in ERRATA}) == len(ERRATA)
