"""An advice as page, charts, tables and JSON."""

import json
import re

import pytest

from advised_robots import whole_advice
from diff_encoder_sim.advice.advice_page import advice_charts, write_page
from diff_encoder_sim.advice.advice_tables import VERSION, advice_json, advice_tables, shown_counts
from places import ROOT


def page_of(advice, folder):
    write_page(advice, folder / 'advice.html')
    return (folder / 'advice.html').read_text(encoding='utf-8')


def rows_with(column, advice):
    """The rows of the charts' data that has a column."""
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', advice_charts(advice), re.DOTALL)
    [columns] = [each for each in json.loads(content)['data'].values() if column in each]
    return [dict(zip(columns, row)) for row in zip(*columns.values())]


def test_the_page_has_answers_charts_and_tables(tmp_path):
    page = page_of(whole_advice(), tmp_path)
    assert '<title>Which encoder for alto?</title>' in page
    assert '<dt>true pose at the goal</dt><dd>at least 40 counts per revolution; 28 do not suffice</dd>' in page
    assert 'id="chart-share"' in page and 'id="chart-budget"' in page
    assert 'Encoders on these wheels' in page and '34 closed-loop trials' in page
    assert len(page) < 3_000_000
    assert not re.search('(src|href)="http', page.replace('http://www.w3.org/', ''))


@pytest.mark.heavy
def test_bars_of_an_encoder_add_up_to_the_root_mean_square():
    advice = whole_advice()
    rows = [row for row in rows_with('rms', advice) if row['criterion'] == 'odometry' and row['axis'] == 'across']
    for counts, budget in advice.budgets['SL'].items():
        rms_mm = 1e3 * (budget.found.bias[1] ** 2 + budget.found.variance[1]) ** 0.5
        assert sum(row['rms'] for row in rows if row['counts'] == counts) == pytest.approx(rms_mm, rel=0.05)


def tables():
    return {table.title: table for table in advice_tables(whole_advice())}


def test_trials_are_in_the_order_of_encoders():
    table = tables()['Closed-loop trials within the tolerance']
    assert table.heads == ['test', '', '28 PPR', '40 PPR']
    assert table.rows[2] == ['SL', 'true pose at the goal', '12/17', '17/17']


def test_budgets_are_of_the_answers_encoders_and_end_with_what_was_found():
    table = tables()['Error budget: mean ± standard deviation']
    titles = [row[0] for row in table.rows if row[0]]
    counts = shown_counts(whole_advice(), list(whole_advice().budgets['SL']))
    assert titles == [f'SL: odometry at the true pose, {counts:g} PPR', 'SL: true pose at the goal, 40 PPR, 17 trials']
    assert abs(counts - 347.0) < 15.0
    causes = [row[1] for row in table.rows]
    assert causes == [
        *('quantisation', 'simulated contact', 'rest', 'found'),
        *('stopping', 'localization', 'encoder', 'rest', 'found'),
    ]
    assert not any('-0.0 ' in text for row in table.rows for text in row)


def test_encoders_say_yes_no_or_that_it_is_not_known():
    table = tables()['Encoders on these wheels']
    assert table.heads[-4:] == ['odometry', 'pose estimate', 'true pose', 'own errors']
    assert table.rows[0] == ['amt102', 'industrial low', '8192', '586.8', '98 to 100 %', 'yes', 'yes', 'yes', '']
    assert table.rows[1][-4:] == ['no', '?', '?', '']
    assert {len(row) for row in table.rows} == {len(table.heads)}


@pytest.fixture(scope='module')
def content():
    return json.loads(json.dumps(advice_json(whole_advice()), allow_nan=False))


def test_answers_are_by_question(content):
    answers = content['answers']
    assert list(answers) == ['odometry', 'pose_estimate', 'truth']
    assert answers['odometry']['kind'] == 'from'
    assert 330.0 < answers['odometry']['smallest_ppr'] < 365.0
    low, high = answers['odometry']['interval']
    assert low <= answers['odometry']['smallest_ppr'] <= high
    assert answers['pose_estimate'] == {
        'kind': 'undecided',
        'smallest_ppr': None,
        'interval': [None, None],
        'encoder': None,
        'limit': [],
        'more_trials': 12,
        'undecided_encoder': None,
        'errors_of': None,
        'text': 'undecided, about 12 more trials of each test would decide',
    }
    assert answers['truth']['encoder'] == '40'


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
    for part in ('answers', 'trials[]', 'encoders[]'):
        value = content
        for name in part.replace('[]', '.0').split('.'):
            value = value[int(name)] if name.isdigit() else value[name]
        names = next(iter(value.values())) if part == 'answers' else value
        prefix = 'answers.<criterion>' if part == 'answers' else part
        assert {f'{prefix}.{name}' for name in names} <= documented
