"""The order of a dataset's cells."""

from campaign_files import NOISE
from diff_encoder_sim.analysis.dataset import CellKey, Dataset, TrialData
from diff_encoder_sim.drives.trial_definition import Outcome
from synthetic_trials import ALTO


def data(test, ppr, number=1, varied=()):
    return TrialData(test, ppr, varied, number, number, Outcome.SUCCEEDED, '', 1.0, 1.0, {}, {}, None, None)


def test_cells_are_in_the_papers_order():
    trials = [data(test, ppr) for test in ('office', 'DLD', 'SL') for ppr in ('ideal', '1024', '40', '90-1024')]
    cells = Dataset('', trials, [], None, None, ALTO, {}).cells()
    assert [cell[:2] for cell in cells] == [
        (test, ppr) for test in ('SL', 'DLD', 'office') for ppr in ('40', '1024', '90-1024', 'ideal')
    ]


def test_what_is_varied_is_not_pooled():
    trials = [data('SL', '40', number, ((NOISE, value),)) for value in ('0.03', '0.01') for number in (1, 2)]
    cells = Dataset('', trials, [], None, None, ALTO, {}).cells()
    assert list(cells) == [CellKey('SL', '40', ((NOISE, '0.03'),)), CellKey('SL', '40', ((NOISE, '0.01'),))]
    assert all(len(pooled) == 2 for pooled in cells.values())
