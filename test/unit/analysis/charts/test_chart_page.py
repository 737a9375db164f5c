"""The block of HTML with a page's charts: what the browser is given."""

import json
import re

import altair as alt
import pandas as pd
import pytest
import vl_convert

from diff_encoder_sim.analysis.charts import chart_page
from diff_encoder_sim.analysis.charts.chart_page import Chart, Choice, Option, charts_html

ENCODER = Choice('encoder', 'Encoder', [Option('40', '40 PPR', '#123456'), Option('90', '90 PPR')], ['90'], 'checkbox')
TEST = Choice('test', 'Test', [Option('SL', 'straight'), Option('SMT', 'turns')], 'SMT', 'radio')
OPTIONS = [Option(7, 'seventh', within='SL'), Option(8, 'eighth', within='SMT')]
TRIAL = Choice('trial', 'Trial', OPTIONS, 8, 'select', 'test', 'path')
EVIL = '</script><b>&"'


def chart(name='ends', description='Where trials end.', **columns):
    rows = pd.DataFrame(columns or {'x': [1.5, 2.0], 'name': ['a', 'b']})
    return Chart(name, 'Ends', description, alt.layer(alt.Chart(rows).mark_point().encode(x='x:Q')))


def content(html):
    [text] = re.findall(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    return json.loads(text)


def test_charts_share_their_data_by_column_and_the_choices_as_parameters():
    html = charts_html([chart(), chart('again')], [ENCODER, TEST, TRIAL])
    given = content(html)
    [(name, columns)] = given['data'].items()
    assert columns == {'x': [1.5, 2.0], 'name': ['a', 'b']}
    for each in given['charts']:
        assert each['spec']['datasets'] == [name]
        values = {parameter['name']: parameter.get('value') for parameter in each['spec']['params']}
        assert (values['encoder'], values['test'], values['trial']) == (['90'], 'SMT', 8)
    assert given['choices'][0] == {'name': 'encoder', 'values': ['40', '90']}
    assert re.findall(r'<input type="(\w+)" name="(\w+)" value="(\d)"( checked)?>', html) == [
        ('checkbox', 'encoder', '0', ''),
        ('checkbox', 'encoder', '1', ' checked'),
        ('radio', 'test', '0', ''),
        ('radio', 'test', '1', ' checked'),
    ]
    assert re.findall(r'<option value="(\d)"( selected)?>', html) == [('0', ''), ('1', ' selected')]
    assert '<span style="color: #123456" aria-hidden="true">●</span>40 PPR' in html


def test_no_text_ends_a_script_or_becomes_an_element():
    html = charts_html([chart(description=EVIL, x=[1.0], bag=[EVIL])], [ENCODER._replace(label=EVIL)])
    assert EVIL not in html and html.count('</script') == 3
    [columns] = content(html)['data'].values()
    assert columns['bag'] == [EVIL]


@pytest.mark.parametrize('is_writable', [True, False])
def test_vega_is_bundled_once_for_a_user_with_a_cache(monkeypatch, tmp_path, is_writable):
    (tmp_path / 'a file').write_text('')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / ('cache' if is_writable else 'a file')))
    made = []
    monkeypatch.setattr(vl_convert, 'javascript_bundle', lambda *_, **__: made.append(1) or 'vega ±')
    assert [chart_page.vega_library() for _ in range(2)] == ['vega ±'] * 2
    assert len(made) == (1 if is_writable else 2)
