"""Which charts and choices a report has."""

import json
import re

from diff_encoder_sim.analysis import first_trials
from diff_encoder_sim.analysis.first_trials import first_of_cells
from diff_encoder_sim.analysis.report.trial_charts import trial_charts as charts_of
from diff_encoder_sim.drives.trial_definition import Outcome
from figure_panels import driven
from paper_datasets import IN, cell, dataset, trial


def trial_charts(made):
    return charts_of(made, first_of_cells(made))


def content_of(html):
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    return json.loads(content)


def charts(html):
    return re.findall(r'<figure id="chart-(\w+)">', html)


def options(html, name):
    legend = {'setup': 'Test', 'encoders': 'Encoder', 'sources': 'Pose'}[name]
    html = str(html)  # a Markup escapes what it is asked for
    field = html[html.index(f'<legend>{legend}</legend>') :].partition('</fieldset>')[0]
    return re.findall(r'(?:</span>|">| checked>)([^<>]+)</label>', field)


def test_a_dataset_with_bags_has_all_charts():
    html = trial_charts(driven())
    assert charts(html) == ['scatter', 'distributions', 'path']
    assert options(html, 'encoders') == ['40 PPR', '90 PPR'] and options(html, 'setup') == ['SL']


def test_colours_are_those_of_the_figures():
    html = trial_charts(driven())
    scatter = content_of(html)['charts'][0]['spec']['layer'][-1]['encoding']['color']
    assert scatter['scale'] == {'domain': ['40', '90'], 'range': ['#7ad151', '#440154']}
    assert 'style="color: #7ad151"' in html


def test_of_many_trials_the_first_of_each_cell_are_points_and_spreads_are_of_all(monkeypatch):
    monkeypatch.setattr(first_trials, 'MOST_SHOWN', 5)
    made = dataset(*(cell('SL', ppr, 'world', [IN, (0.02, 0.1, 0.0)] * 10) for ppr in ('40', '90')))
    html = trial_charts(made)
    data = content_of(html)['data']
    assert data['errors']['encoder'] == ['40', '40', '90', '90'] and data['trials']['number'] == [1, 2, 1, 2]
    assert set(data['spreads']['trials']) == {20}
    assert 'The first 2 trials of each cell, of 40, with median and quartiles' in html


def test_charts_without_data_are_left_out():
    spread = dataset(cell('SL', '40', 'world', [IN, (0.02, 0.0, 0.0)]))
    assert charts(trial_charts(spread)) == ['scatter', 'distributions', 'curve']
    assert options(trial_charts(spread), 'sources') == ['/world_pose minus goal']
    assert charts(trial_charts(dataset(cell('SL', 'ideal', 'world', [IN] * 2)))) == ['scatter', 'distributions']
    assert trial_charts(dataset([trial('SL', '40', 1, outcome=Outcome.LOST)])) is None
