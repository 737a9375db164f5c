"""The page: one file, well formed, with all data escaped."""

import base64
import html
import html.parser
import json
import re

import pytest

from diff_encoder_sim.analysis.charts.figures import Figure
from diff_encoder_sim.analysis.encoder_comparison import compare_encoders
from diff_encoder_sim.analysis.paper.report_section import paper_section
from diff_encoder_sim.analysis.report import page
from diff_encoder_sim.analysis.report.answer import find_answer, report_link
from diff_encoder_sim.analysis.tables import all_tables
from places import ROOT
from trial_tables import IN, both, cell, results_of, rows, trial

MANIFEST = {
    'fingerprint': 'abc',
    'seeds': {'first': 1, 'last': 30},
    'runs': [
        {
            'command': ['/ws/scripts/campaign', '--config', 'my file.yaml', '--out', 'results'],
            'versions': {'numpy': '2.0', 'dask': None},
            'commit': {'id': 'abc', 'is_dirty': True},
            'machine': {'cpu': 'a chip', 'cores': 4, 'usable_cores': 2, 'memory_bytes': 8 * 2**30, 'os': 'Linux'},
        }
    ],
    'configuration': {'nav': 'embedded', 'tests': [{'world': 'hallway'}]},
}
PNG = 100 * b'a PNG'
MADE = results_of([trial('SL', '40')])


class Elements(html.parser.HTMLParser):
    """Collects attributes by element; asserts that each that has an end is ended in order."""

    def __init__(self, text):
        super().__init__()
        self.starts, self._open = [], []
        self.feed(text)
        assert not self._open

    def handle_starttag(self, tag, attrs):
        self.starts.append((tag, dict(attrs)))
        self._open += [tag] * (tag not in {'meta', 'link', 'img', 'input'})

    def handle_endtag(self, tag):
        assert self._open.pop() == tag, (tag, self.getpos())

    def of(self, tag):
        return [attributes for name, attributes in self.starts if name == tag]


@pytest.fixture
def figure(tmp_path):
    svg, png = tmp_path / 'a.svg', tmp_path / 'a.png'
    svg.write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    png.write_bytes(PNG)
    return Figure('a', 'A caption <of> it.', png, svg)


def page_of(made, folder, figures=()):
    path = folder / 'report.html'
    paper, answer = paper_section([made]), find_answer(made)
    lead = page.write_report(made, all_tables(made), compare_encoders(made), figures, paper, answer, path)
    text = path.read_text(encoding='utf-8')
    parts, shown = (lead.statement, *lead.by_pose, *lead.by_pose.values(), lead.failures), html.unescape(text)
    assert all(part in shown for part in parts)
    return text


def test_the_page_is_one_file_with_heads_captions_and_texts_for_pictures(tmp_path, figure):
    made = results_of(*(both(test, ppr, (20, 10), (15, 15)) for test in ('SL', 'SMT') for ppr in ('40', '4096')))
    text = page_of(made, tmp_path, [figure])
    again = page_of(made, tmp_path, [figure])
    assert len({re.sub(r'[-\d]+ [\d:]+ UTC', '', each) for each in (text, again)}) == 1  # equal data gives equal bytes
    elements = Elements(text)
    assert [link['href'] for link in elements.of('link')] == ['data:,']
    assert all('src' not in script for script in elements.of('script'))
    assert not re.search(r'@import|url\(', re.sub(r'<script.*?</script>', '', text, flags=re.DOTALL))
    [image] = elements.of('img')
    assert image['src'].startswith('data:') and image['alt'] == 'A caption <of> it.'
    assert all(attributes.get('scope') for attributes in elements.of('th'))
    assert len(elements.of('caption')) == len(elements.of('table'))
    ids = [attributes['id'] for _, attributes in elements.starts if 'id' in attributes]
    assert len(ids) == len(set(ids))
    links = {link['href'][1:] for link in elements.of('a') if link['href'].startswith('#')}
    assert {section['id'] for section in elements.of('section')} <= links <= set(ids)


def test_all_that_comes_from_data_is_escaped_and_a_trial_needs_no_pose(tmp_path):
    evil = '<script>alert("1")</script>'
    failed = trial(evil, '40', outcome='lost', reason=evil, world=IN, **{evil: evil})
    trials = [failed, trial('SL', '40', **{evil: 'x'})]
    configuration = {'tests': [], 'evil': evil, 'nav': evil}
    named = {'title': evil, 'notes': [evil], 'manifest': {**MANIFEST, 'configuration': configuration}}
    text = page_of(results_of(trials, varied=[evil], folder=tmp_path, **named), tmp_path)
    assert Elements(text).starts and evil not in text and text.count('&lt;script&gt;alert(') > 5


def test_variants_come_first_and_only_the_first_of_them_is_unfolded(tmp_path, figure, monkeypatch):
    monkeypatch.setattr(page, 'trial_charts', lambda *_: None)
    names = ('none', 'missed 1 %', 'restart')
    made = results_of(*(both('SL', '40', (20, 0), (10, 10), variant=name) for name in names), varied=['variant'])
    text = page_of(made, tmp_path, [figure._replace(name='variants'), figure])
    variants, summary, figures = (text.index(f'id="{name}"') for name in ('variants', 'summary', 'figures'))
    assert text[variants:summary].count('<img') == 1 and 'final odometry error' in text[variants:summary]
    folded = text.index('<details>', summary)
    assert text.index('SL, none', summary) < folded < text.index('SL, missed 1 %', summary) < figures


def test_bags_are_linked_relative_to_the_report(tmp_path):
    bags = tmp_path / 'results' / 'bags' / 'SL 1.bag', tmp_path / 'a&"#?.bag', ''
    (tmp_path / 'analysis').mkdir()
    trials = [trial('SL', '40', number, bag=str(bag)) for number, bag in enumerate(bags)]
    links = [link['href'] for link in Elements(page_of(results_of(trials), tmp_path / 'analysis')).of('a')]
    assert [link for link in links if '.bag' in link] == ['../results/bags/SL%201.bag', '../a%26%22%23%3F.bag']


def test_failures_are_listed_with_their_outcome():
    table = page.failure_table(results_of(cell('SL', '40', 'world', rows(2, 0), outcome='timed_out')).trials)
    assert (
        table.exact[['cell', 'outcome']].values.tolist() == [['SL, 40 counts', 'timed out']] * 2 and table.notes == []
    )


def test_the_smaller_form_of_a_figure_is_taken(figure):
    assert page.data_uri(figure.svg, figure.png).startswith('data:image/svg+xml,%3Csvg xmlns')
    figure.svg.write_text(1000 * figure.svg.read_text())
    assert page.data_uri(figure.svg, figure.png) == f'data:image/png;base64,{base64.b64encode(PNG).decode()}'


@pytest.mark.parametrize(
    ('command', 'again'),
    [
        (MANIFEST['runs'][0]['command'], "rosrun diff_encoder_sim {} --config 'my file.yaml' --out results"),
        (['/venv/bin/diff-encoder-sim', 'campaign', '--out', 'results'], 'diff-encoder-sim {} --out results'),
    ],
)
def test_the_origin_names_the_commands(tmp_path, command, again):
    manifest = {'runs': [{**MANIFEST['runs'][0], 'command': command}]}
    found = page.commands(MADE._replace(manifest=manifest, folder=tmp_path))
    assert found == [again.format('campaign'), f'{again.partition(" {}")[0]} analyze {tmp_path}']
    assert page.commands(MADE) == []


@pytest.mark.parametrize(
    ('checks', 'texts'),
    [
        ([('torque', True, '')], ['It passed all 1 checks', 'torque 100 % ok']),
        ([('torque', False, 'do')], ['Its self-check failed (torque): these', 'torque 100 % NOT OK: do']),
        ([], ['It was not checked.']),
    ],
)
def test_the_robot_has_its_checks_and_the_sources_of_its_values_and_an_encoder_those_of_its_counts(
    tmp_path, monkeypatch, checks, texts
):
    monkeypatch.setattr(page, 'trial_charts', lambda *_: None)
    robot = {'name': 'r2', 'file': 'r2.yaml', 'set': {'config.wheel_diameter': 0.1}, 'notes': []}
    robot['found'] = [{'quantity': 'mass [kg]', 'value': '32', 'source': '<inertial>'}]
    robot['checks'] = [dict(zip(('name', 'is_ok', 'advice'), each), value='100 %') for each in checks]
    robot['warnings'] = ['one wheel is flat']
    amt102 = {'label': '8192 amt102', 'name': 'AMT102-V', 'price': 'industrial', 'resolution': '2048 lines x 4 = 8192'}
    amt102.update(source=['datasheet', 'manual'], counts_per_metre=13037.97)
    text = page_of(MADE._replace(manifest={**MANIFEST, 'robot': robot, 'encoders': [amt102]}), tmp_path)
    shown = ' '.join(html.unescape(re.sub('<[^>]+>', ' ', text)).split())
    texts += ['one wheel is flat', 'mass [kg] 32 <inertial>', 'config.wheel_diameter 0.1']
    texts += ['amt102 (8192 counts) AMT102-V industrial 2048 lines x 4 = 8192 13038.0 datasheet; manual']
    texts += ['analysed with python ', 'fingerprint of the configuration abc', 'seeds 1 to 30', 'world: hallway']
    texts += ['versions numpy 2.0 commit abc with changes host a chip, 2 of 4 cores, 8 GiB, Linux']
    assert [one for one in texts if one not in shown] == []
    assert Elements(text).starts and ('Self-check' in shown) == bool(checks)


def test_cells_with_too_few_trials_are_grey_folded_and_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(page, 'trial_charts', lambda *_: None)
    made = results_of(both('SL', '40', (20, 0), (10, 10)), both('SMT', '40', (2, 0), (0, 2)))
    text = page_of(made, tmp_path)
    summary, figures = text.index('id="summary"'), text.index('id="tables"')
    shown, _, folded = text[summary:figures].partition('<details>')
    assert 'aria-label="SL"' in shown and 'class="few"' not in shown and 'aria-label="SMT"' in folded
    assert '<b>1 of 3 cells are undecided</b>: each has at most 2 trials, and at\nleast 16 are needed' in shown
    assert (folded.count('class="few"'), folded.count('class="no"')) == (1, 2)  # 0 of 2 are fewer than 80 %


def test_it_starts_with_the_answer_of_advise_or_names_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(page, 'trial_charts', lambda *_: None)
    robot = {'name': 'alto', 'file': str(ROOT / 'config' / 'robots' / 'alto.yaml')}
    robot.update({key: [] for key in ('found', 'warnings', 'notes', 'checks')}, set={})
    made = MADE._replace(folder=tmp_path, manifest={**MANIFEST, 'robot': robot})
    (tmp_path / 'analysis').mkdir()
    command = f'rosrun diff_encoder_sim advise --robot alto --no-trials --out {tmp_path}/advice'
    assert f'<code>{command}</code>' in page_of(made, tmp_path / 'analysis')
    (tmp_path / 'advice').mkdir()
    content = {'robot': {'name': 'alto'}, 'assumptions': 'no slip', 'summary': {'requirement': '80 %', 'answers': {}}}
    for answers, is_shown in (({'odometry': 'at least <347>'}, True), (['?'], False)):
        content['summary']['answers'] = answers
        (tmp_path / 'advice' / 'advice.json').write_text(json.dumps(content))
        text = page_of(made, tmp_path / 'analysis')
        assert ('<dt>odometry</dt><dd>at least &lt;347&gt;</dd>' in text) == is_shown == (command not in text)
        assert ('<a href="../advice/advice.html">Which encoder for alto?</a>' in text) == is_shown


def test_the_advice_leads_to_the_report_that_exists_or_will(tmp_path):
    assert report_link(tmp_path / 'advice') == []
    (tmp_path / 'manifest.json').touch()
    report = tmp_path / 'analysis' / 'report.html'
    (link,) = report_link(tmp_path / 'advice')
    assert link.path == report and link.command == f'rosrun diff_encoder_sim analyze {tmp_path}'
    report.parent.mkdir()
    report.touch()
    assert report_link(tmp_path / 'advice') == [link._replace(command='')] == report_link(tmp_path)
    assert report_link(tmp_path / 'other') == []
