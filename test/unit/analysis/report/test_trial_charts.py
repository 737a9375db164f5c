"""Which charts and choices a report has."""

import json
import re

from diff_encoder_sim.analysis.report.trial_charts import trial_charts
from diff_encoder_sim.trials.trial_outcome import Outcome
from figure_panels import driven
from paper_datasets import IN, cell, dataset, trial


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


def test_charts_without_data_are_left_out():
    spread = dataset(cell('SL', '40', 'world', [IN, (0.02, 0.0, 0.0)]))
    assert charts(trial_charts(spread)) == ['scatter', 'distributions', 'curve']
    assert options(trial_charts(spread), 'sources') == ['/world_pose minus goal']
    assert charts(trial_charts(dataset(cell('SL', 'ideal', 'world', [IN] * 2)))) == ['scatter', 'distributions']
    assert trial_charts(dataset([trial('SL', '40', 1, outcome=Outcome.LOST)])) is None


def test_many_sets_of_parameters_are_a_list():
    cells = [cell('SL', '40', 'world', [IN], varied=(('variant', f'v{number}'),)) for number in range(9)]
    html = trial_charts(dataset(*cells))
    assert '<select name="setup">' in html and html.count('<option') == 9


def test_colours_are_those_of_the_figures():
    html = trial_charts(driven())
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    scatter = json.loads(content)['charts'][0]['spec']['layer'][-1]['encoding']['color']
    assert scatter['scale'] == {'domain': ['40', '90'], 'range': ['#7ad151', '#440154']}
    assert 'style="color: #7ad151"' in html
