"""The trials of the report."""

from diff_encoder_sim.analysis import first_trials
from diff_encoder_sim.analysis.report.trials import bag_links, failure_table
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import IN, cell, dataset


def test_bags_are_linked_relative_to_the_report(tmp_path):
    bags = [tmp_path / 'results' / 'bags' / 'SL 1.bag', None, tmp_path / 'a&"#?.bag']
    trials = [one._replace(bag=bag) for one, bag in zip(cell('SL', '40', 'world', [IN] * 3), bags)]
    links = bag_links(dataset(trials), tmp_path / 'results' / 'analysis')
    assert links == [('SL 1.bag', '../bags/SL%201.bag'), None, ('a&"#?.bag', '../../a%26%22%23%3F.bag')]


def test_of_many_failures_the_first_of_each_cell_are_listed(monkeypatch):
    made = dataset(*(cell('SL', ppr, 'world', [IN] * 3, outcome=Outcome.LOST) for ppr in ('40', '90')))
    assert len(failure_table(made).rows) == 6 and failure_table(made).notes == []
    monkeypatch.setattr(first_trials, 'MOST_SHOWN', 2)
    table = failure_table(made)
    assert [row[0] for row in table.rows] == ['SL, 40 PPR', 'SL, 90 PPR']
    assert table.notes == ['The first 1 trials of each cell, of 6.']
