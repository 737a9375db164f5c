"""Of many trials, the first of each cell."""

from diff_encoder_sim.analysis import first_trials
from diff_encoder_sim.analysis.first_trials import first_of_cells, sample_text
from paper_datasets import IN, cell, dataset


def test_of_many_each_cell_has_equally_many_and_one_at_least(monkeypatch):
    made = dataset(cell('SL', '40', 'world', [IN] * 9), cell('SL', '90', 'world', [IN] * 2))
    for most, counts in ((10, [5, 2]), (6, [3, 2]), (1, [1, 1])):
        monkeypatch.setattr(first_trials, 'MOST_SHOWN', most)
        shown = first_of_cells(made)
        assert [len(trials) for trials in shown.cells().values()] == counts
        assert [trial.trial for trial in shown.trials] == [*range(1, counts[0] + 1), *range(1, counts[1] + 1)]
    assert sample_text(shown, made) == 'The first 1 trials of each cell, of 11'
