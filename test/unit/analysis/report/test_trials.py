"""The trials of the report."""

from diff_encoder_sim.analysis.report.trials import bag_links
from paper_datasets import IN, cell, dataset


def test_bags_are_linked_relative_to_the_report(tmp_path):
    bags = [tmp_path / 'results' / 'bags' / 'SL 1.bag', None, tmp_path / 'a&"#?.bag']
    trials = [one._replace(bag=bag) for one, bag in zip(cell('SL', '40', 'world', [IN] * 3), bags)]
    links = bag_links(dataset(trials), tmp_path / 'results' / 'analysis')
    assert links == [('SL 1.bag', '../bags/SL%201.bag'), None, ('a&"#?.bag', '../../a%26%22%23%3F.bag')]
