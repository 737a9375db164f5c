"""The block of HTML with a page's charts: what the browser is given."""

import json
import re

import pytest

from diff_encoder_sim.analysis.charts import Chart, Choice, Look, Option, charts_html

SPEC = {'data': {'name': 'ends'}, 'mark': 'point', 'params': [{'name': 'own', 'value': 1}]}
ENCODER = Choice('encoder', 'Encoder', [Option('40', '40 PPR', '#123456'), Option('90', '90 PPR')], ['90'], Look.BOXES)
TEST = Choice('test', 'Test', [Option('SL', 'straight'), Option('SMT', 'turns')], 'SMT', Look.BUTTONS)
TRIAL = Choice(
    'trial',
    'Trial',
    [Option(7, 'seventh', within='SL'), Option(8, 'eighth', within='SMT')],
    8,
    Look.LIST,
    'test',
    'path',
)
EVIL = '</script><b>&"'


def chart(name='ends', description='Where trials end.', **others):
    return Chart(name, 'Ends', description, SPEC, **others)


def content(html):
    [text] = re.findall(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    return json.loads(text)


def test_data_is_given_by_column():
    html = charts_html([chart()], {'ends': [{'x': 1.5, 'name': 'a'}, {'x': None, 'name': 'b'}], 'none': []})
    assert content(html)['data'] == {'ends': {'x': [1.5, None], 'name': ['a', 'b']}, 'none': {}}


def test_choices_are_parameters_of_every_chart():
    given = content(charts_html([chart(), chart('path')], {}, [ENCODER, TEST]))
    for each in given['charts']:
        own = [{'name': 'encoder', 'value': ['90']}, {'name': 'test', 'value': 'SMT'}, {'name': 'own', 'value': 1}]
        assert each['spec']['params'] == own
    assert given['choices'][0] == {'name': 'encoder', 'values': ['40', '90']}
    assert SPEC['params'] == [{'name': 'own', 'value': 1}]


def test_each_choice_shows_what_is_chosen_at_first():
    html = charts_html([chart()], {}, [ENCODER, TEST, TRIAL])
    inputs = re.findall(r'<input type="(\w+)" name="(\w+)" value="(\d)"( checked)?>', html)
    assert inputs == [
        ('checkbox', 'encoder', '0', ''),
        ('checkbox', 'encoder', '1', ' checked'),
        ('radio', 'test', '0', ''),
        ('radio', 'test', '1', ' checked'),
    ]
    assert re.findall(r'<option value="(\d)"( selected)?>', html) == [('0', ''), ('1', ' selected')]
    assert '<span style="color: #123456" aria-hidden="true">●</span>40 PPR' in html


def test_no_text_ends_the_script_or_becomes_an_element():
    html = charts_html([chart(description=EVIL)], {'ends': [{'bag': EVIL}]}, [ENCODER._replace(label=EVIL)])
    assert EVIL not in html
    assert content(html)['data']['ends']['bag'] == [EVIL]


def test_what_is_no_number_is_refused():
    with pytest.raises(ValueError):
        charts_html([chart()], {'ends': [{'x': float('nan')}]})
