"""An advice as page, charts, tables and JSON."""

import json
import os
import re

import pytest

from advised_robots import LIMITED, REACH, advice_with_imus, whole_advice
from diff_encoder_sim.advice.advice_page import advice_charts, write_page
from diff_encoder_sim.advice.advice_tables import VERSION, advice_json, advice_tables, answers_text, shown_counts
from diff_encoder_sim.advice.odometry_study import with_budgets
from diff_encoder_sim.analysis.report.about import PageAbout
from diff_encoder_sim.robots.wheel_quality import QUALITIES
from places import ROOT


def page_of(advice, folder):
    write_page(advice, PageAbout('advise', ''), folder / 'advice.html')
    return (folder / 'advice.html').read_text(encoding='utf-8')


def rows_with(column, advice):
    """The rows of the charts' data that has a column."""
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', advice_charts(advice), re.DOTALL)
    [columns] = [each for each in json.loads(content)['data'].values() if column in each]
    return [dict(zip(columns, row)) for row in zip(*columns.values())]


def test_the_page_has_answers_charts_and_tables(tmp_path):
    page = page_of(whole_advice(), tmp_path)
    assert '<title>Which encoder for alto?</title>' in page
    assert '<dt>true pose at the goal</dt><dd>at least 40 counts per wheel turn; 28 do not suffice</dd>' in page
    assert 'id="chart-share"' in page and 'id="chart-budget"' in page
    assert 'Encoders on these wheels' in page and '34 closed-loop trials' in page
    assert len(page) < 3_000_000
    assert not re.search('(src|<link[^>]* href)="http', page.replace('http://www.w3.org/', ''))
    for text in ('CUI Devices', 'capacitive kit', 'industrial low', 'any'):
        assert f'<td>{text}</td>' in page
    link = '<a href="https://www.cuidevices.com/product/resource/amt10.pdf">AMT102-V, at 2048 lines</a>'
    assert f'<td>{link}</td>' in page


def test_bars_of_an_encoder_add_up_to_the_root_mean_square():
    advice = whole_advice()
    rows = [row for row in rows_with('rms', advice) if row['criterion'] == 'odometry' and row['axis'] == 'across']
    for counts, budget in advice.budgets['SL'].items():
        rms_mm = 1e3 * (budget.found.bias[1] ** 2 + budget.found.variance[1]) ** 0.5
        assert sum(row['rms'] for row in rows if row['counts'] == counts) == pytest.approx(rms_mm, rel=0.05)


@pytest.fixture(name='tables', scope='module')
def fixture_tables():
    return {table.title: table for table in advice_tables(whole_advice())}


def test_trials_are_in_the_order_of_encoders(tables):
    table = tables['Closed-loop trials within the tolerance']
    assert table.heads == ['test', '', '28 counts', '40 counts']
    assert table.rows[2] == ['SL', 'true pose at the goal', '12/17', '17/17']


def test_budgets_are_of_the_answers_encoders_and_end_with_what_was_found(tables):
    counts = shown_counts(whole_advice(), list(whole_advice().budgets['SL']))
    odometry, truth = [table for title, table in tables.items() if title.startswith('Error budget')]
    assert odometry.title.endswith(f': SL, odometry at the true pose, {counts:g} counts') and abs(counts - 347.0) < 15.0
    assert truth.title.endswith(': SL, true pose at the goal, 40 counts, 17 trials')
    assert [row[0] for row in odometry.rows] == ['quantisation', 'simulated contact', 'rest', 'found']
    assert [row[0] for row in truth.rows] == ['stopping', 'localization', 'encoder', 'rest', 'found']
    assert not any('-0.0 ' in text for row in odometry.rows + truth.rows for text in row)


def test_the_budget_is_of_the_only_requested_counts():
    [budget, *_] = [table for table in advice_tables(with_budgets(whole_advice(), [90.0])) if 'budget' in table.title]
    assert budget.title.endswith(': SL, odometry at the true pose, 90 counts')


def test_encoders_say_yes_no_or_that_it_is_not_known(tables):
    table, of_robots = tables['Encoders on these wheels'], tables['Encoders of robots on these wheels']
    assert table.heads[-3:] == ['odometry', 'pose\nestimate', 'true\npose']
    assert table.rows == [['amt102', 'industrial low', 'any', '8192', '586.8', '98–100 %', 'yes', 'yes', 'yes']]
    assert of_robots.rows == [['own of alto', '', '90', '90', '10–20 %', 'no', '?', '?']]


def test_tables_of_encoders_fit_the_terminal():
    limit = LIMITED.limits[0]
    listed = [one._replace(name='own of gearmotor_kit', limit=[limit] * 3) for one in whole_advice().encoders]
    listed[0] = listed[0]._replace(name='hoverboard_hub')
    *_, encoders, of_robots = advice_tables(whole_advice()._replace(encoders=listed))
    assert max(map(len, f'{encoders.text()}\n{of_robots.text()}'.splitlines())) <= 100
    own = 'own errors of own of gearmotor_kit that are too large: wheel radius 0.64 m, 50 mm allowed;'
    assert own in of_robots.text()


@pytest.fixture(scope='module')
def content():
    return json.loads(json.dumps(advice_json(whole_advice()), allow_nan=False))


def test_answers_are_by_question(content):
    answers = content['answers']
    assert list(answers) == ['odometry', 'pose_estimate', 'truth'] and answers['truth']['encoder'] == '40'
    odometry, (low, high) = answers['odometry'], answers['odometry']['interval']
    assert odometry['kind'] == 'from' and max(330.0, low) <= odometry['smallest_ppr'] <= min(365.0, high)
    nothing = dict.fromkeys(('smallest_ppr', 'encoder', 'lines', 'reach', 'undecided_encoder', 'errors_of'))
    text = 'undecided, about 12 more trials of each test would decide'
    undecided = {'kind': 'undecided', 'interval': [None, None], 'limit': [], 'more_trials': 12, 'text': text}
    assert answers['pose_estimate'] == {**nothing, **undecided}


def test_the_documentation_has_all_wheels():
    text = (ROOT / 'docs' / 'which_encoder.md').read_text(encoding='utf-8')
    for wheels in QUALITIES.values():
        assert re.search(rf'\| `{wheels.name}` \| {100.0 * wheels.std:g}( %)? \| {wheels.source.split(",")[0]}', text)


def test_answers_are_by_wheels_too(content):
    assert content['wheels'] == 'exact' and content['answers_by_wheels']['exact'] == content['answers']
    (calibrated,) = content['answers_by_wheels']['calibrated'].values()
    assert calibrated['reach'] == {**REACH._asdict(), 'after': [20.0, 0.0], 'holds_for': [5.59, 0.0]}
    text = '0.64 m sideways after 20 m, 50 mm allowed: the encoder is not the limit; 50 mm hold for 5.6 m'
    assert calibrated['text'] == text
    better = 'ratio of the radii to 0.0039 % instead of 0.1 %, then at least 389 counts'
    assert content['improvement'] == f'a correction of the pose every 5.6 m; or {better}'


@pytest.mark.parametrize(('columns', 'width'), [(80, 80), (0, 100), (None, 100)])
def test_answers_fit_the_terminal_and_numbers_stay_with_their_units(columns, width, monkeypatch):
    """Some terminals report 0 columns; a pipe is none."""
    monkeypatch.setattr(os, 'isatty', lambda _: columns is not None)
    monkeypatch.setattr(os, 'get_terminal_size', lambda: os.terminal_size((columns, 24)))
    lines = answers_text(whole_advice()).splitlines()
    assert max(map(len, lines)) <= width and not any(re.search(r'\d$', line) for line in lines[:-1])
    heads = [line.partition(': ')[0] for line in lines if not line.startswith('    ')]
    odometry = ['  odometry with exact wheels', '  odometry with wheels calibrated to 0.1 %']
    assert heads[:4] == [odometry[0], '  lines and gear', odometry[1], '  most effective improvement']


def test_budgets_add_up(content):
    for budget in content['budgets']['SL']:
        for axis in ('along', 'across', 'heading'):
            for key in ('bias', 'variance'):
                parts = sum(part[axis][key] for part in budget['parts'].values())
                assert parts + budget['rest'][axis][key] == pytest.approx(budget['found'][axis][key], abs=1e-12)


def test_the_documentation_names_all_keys(content):
    assert content['version'] == VERSION
    text = (ROOT / 'docs' / 'advice_keys.csv').read_text(encoding='utf-8')
    documented = set(re.findall(r'^`([^`]+)`,', text, re.MULTILINE))
    assert set(content) <= {key.split('.')[0].split('[')[0] for key in documented}
    parts = {f'{name}[]': content[name][0] for name in ('trials', 'encoders')}
    parts['answers.<criterion>'] = content['answers']['truth']
    assert {f'{part}.{name}' for part, names in parts.items() for name in names} <= documented


def test_imus_are_in_page_tables_and_json(tmp_path):
    advice = advice_with_imus()
    page = page_of(advice, tmp_path)
    assert 'id="chart-heading"' in page and '<dt>odometry with exact wheels and stim300</dt>' in page
    assert 'id="chart-heading"' not in page_of(whole_advice(), tmp_path)
    titles = [table.title for table in advice_tables(advice)]
    assert 'Counts with an IMU, and without: exact wheels' in titles
    assert [title.rpartition(', ')[2] for title in titles if 'exact wheels, ' in title] == [
        'without stim300',
        'with stim300',
    ]
    bands = [row for row in rows_with('low', advice) if row['axis'] == 'across' and row['IMU'] == 'bno055']
    assert all(row['low'] <= row['error'] <= row['high'] for row in bands) and len(bands) == 7
    content = json.loads(json.dumps(advice_json(advice), allow_nan=False))
    first = content['answers']['odometry_with_imu']
    assert (first['imu'], first['kind'], first['smallest_ppr']) == ('stim300', 'from', 10.0)
    assert [each['imu'] for each in content['imus']] == ['stim300', 'bno055']
    text = (ROOT / 'docs' / 'advice_keys.csv').read_text(encoding='utf-8')
    documented = set(re.findall(r'^`([^`]+)`,', text, re.MULTILINE))
    assert {f'imus[].{key}' for key in content['imus'][0]} <= documented
    assert f'answers.{"odometry_with_imu"}' in documented
    (curve,) = content['imus'][0]['curves'].values()
    assert curve[3]['ppr'] == 90.0 and curve[3]['equal_interval'][0] <= curve[3]['equal_ppr']
