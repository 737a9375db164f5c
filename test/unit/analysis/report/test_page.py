"""The page: one file, well formed, with all data escaped."""

import base64
import html
import html.parser
import io
import re

import numpy as np
import pytest
from PIL import Image

from diff_encoder_sim.analysis import results_table
from diff_encoder_sim.analysis.charts.figures import Figure
from diff_encoder_sim.analysis.encoder_comparison import compare_encoders
from diff_encoder_sim.analysis.paper.report_section import paper_section
from diff_encoder_sim.analysis.report.page import (
    COLOURS,
    bag_link,
    data_uri,
    encoder_section,
    failure_table,
    provenance,
    robot_section,
    write_report,
)
from diff_encoder_sim.analysis.tables import all_tables
from trial_tables import IN, both, cell, results_of, rows, trial

MANIFEST = {
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

# HTML elements that have no end.
VOID = {'meta', 'link', 'img', 'input'}


class Elements(html.parser.HTMLParser):
    """Collects starts of elements; asserts that each is ended in order."""

    def __init__(self, text):
        super().__init__()
        self.starts, self._open = [], []
        self.feed(text)
        assert not self._open

    def handle_starttag(self, tag, attrs):
        self.starts.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag, (tag, self.getpos())

    def of(self, tag):
        return [attributes for name, attributes in self.starts if name == tag]


@pytest.fixture
def figure(tmp_path):
    svg, png = tmp_path / 'a.svg', tmp_path / 'a.png'
    svg.write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>')
    Image.new('RGB', (40, 30)).save(png)
    return Figure('a', 'A caption <of> it.', png, svg)


def page_of(made, folder, figures=()):
    path = folder / 'report.html'
    lead = write_report(made, all_tables(made), compare_encoders(made), figures, paper_section([made]), path)
    page = path.read_text(encoding='utf-8')
    for text in (lead.statement, *lead.by_pose, *lead.by_pose.values(), lead.failures):
        assert text in html.unescape(page)
    return page


def test_the_page_is_one_file_with_heads_captions_and_texts_for_pictures(tmp_path, figure):
    made = results_of(
        *(both(test, ppr, (20, 10), (15, 15)) for test in ('SL', 'SMT') for ppr in ('40', '90', '1024', '4096'))
    )
    page = page_of(made, tmp_path, [figure])
    assert page == page_of(made, tmp_path, [figure])  # equal data gives equal bytes
    elements = Elements(page)
    assert not elements.of('link')[1:] and elements.of('link')[0]['href'] == 'data:,'
    assert all('src' not in script for script in elements.of('script'))
    assert not re.search(r'@import|url\(', re.sub(r'<script.*?</script>', '', page, flags=re.DOTALL))
    [image] = elements.of('img')
    assert image['src'].startswith('data:') and image['alt'] == 'A caption <of> it.'
    assert all(attributes.get('scope') for attributes in elements.of('th'))
    assert len(elements.of('caption')) == len(elements.of('table'))
    ids = [attributes['id'] for _, attributes in elements.starts if 'id' in attributes]
    assert len(ids) == len(set(ids))
    links = {link['href'][1:] for link in elements.of('a')}
    assert {section['id'] for section in elements.of('section')} <= links <= set(ids)


def test_all_that_comes_from_data_is_escaped(tmp_path):
    evil = '<script>alert("1")</script>'
    trials = cell(evil, '40', 'world', rows(10, 10), **{evil: evil})
    trials[0].update(outcome='lost', reason=evil)
    configuration = {'tests': [], 'evil': evil, 'nav': evil}
    named = {'title': evil, 'notes': [evil], 'manifest': {**MANIFEST, 'configuration': configuration}}
    made = results_of(trials, varied=[evil], folder=tmp_path, **named)
    harmless = page_of(results_of(cell('SL', '40', 'world', rows(10, 10))), tmp_path)
    assert Elements(page_of(made, tmp_path)).of('script') == Elements(harmless).of('script')
    Elements(page_of(results_of([trial('SL', 'ideal', 1, outcome='lost')]), tmp_path))  # without a pose


def test_variants_come_first_and_only_the_first_of_them_is_unfolded(tmp_path, figure):
    made = results_of(
        *(both('SL', '40', (2, 0), (1, 1), variant=name) for name in ('none', 'missed 1 %', 'restart')),
        varied=['variant'],
    )
    page = page_of(made, tmp_path, [figure._replace(name='variants'), figure])
    assert page.index('id="variants"') < page.index('id="summary"') < page.index('id="figures"')
    section = page[page.index('id="variants"') : page.index('id="summary"')]
    assert section.count('<img') == 1 and 'final odometry error' in section
    summary = page[page.index('id="summary"') : page.index('id="figures"')]
    assert summary.index('SL, none') < summary.index('<details>') < summary.index('SL, missed 1 %')


def test_bags_are_linked_relative_to_the_report(tmp_path):
    folder = tmp_path / 'results' / 'analysis'
    inside, outside = (bag_link(str(tmp_path / name), folder) for name in ('results/bags/SL 1.bag', 'a&"#?.bag'))
    assert inside == {'name': 'SL 1.bag', 'href': '../bags/SL%201.bag'}
    assert outside == {'name': 'a&"#?.bag', 'href': '../../a%26%22%23%3F.bag'} and bag_link('', folder) is None


def test_of_many_failures_the_first_of_each_cell_are_listed(monkeypatch):
    failed = results_of(*(cell('SL', ppr, 'world', [IN] * 3, outcome='timed_out') for ppr in ('40', '90'))).trials
    assert len(failure_table(failed).exact) == 6 and failure_table(failed).notes == []
    monkeypatch.setattr(results_table, 'MOST_SHOWN', 2)
    table = failure_table(failed)
    assert list(table.exact['cell']) == ['SL, 40 PPR', 'SL, 90 PPR'] and set(table.exact['outcome']) == {'timed out'}
    assert table.notes == ['The first 1 trials of each cell, of 6.']


def test_the_smaller_form_of_a_figure_is_taken_and_pixels_have_few_colours(tmp_path):
    svg, png = tmp_path / 'a.svg', tmp_path / 'a.png'
    svg.write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    Image.fromarray(np.random.default_rng(1).integers(0, 256, (90, 90, 3), np.uint8)).save(png)
    assert data_uri(svg, png).startswith('data:image/svg+xml,%3Csvg xmlns')
    svg.write_text(1000 * svg.read_text())
    kind, _, pixels = data_uri(svg, png).partition(',')
    with Image.open(io.BytesIO(base64.b64decode(pixels))) as image:
        assert kind == 'data:image/png;base64' and image.size == (90, 90) and len(image.getcolors()) <= COLOURS


MADE = results_of([trial('SL', '40')])


def test_the_origin_names_the_commands_and_the_host(tmp_path):
    origin = provenance(MADE._replace(manifest=MANIFEST, folder=tmp_path / 'results'))
    assert origin['commands'] == [
        "rosrun diff_encoder_sim campaign --config 'my file.yaml' --out results",
        f'rosrun diff_encoder_sim analyze {tmp_path}/results',
    ]
    run = dict(origin['runs'][0]['facts'])
    assert run['commit'] == 'abc with changes' and run['versions'] == 'numpy 2.0'
    assert run['host'] == 'a chip, 2 of 4 cores, 8 GiB, Linux'
    assert 'world: hallway' in origin['configuration']
    console = {**MANIFEST['runs'][0], 'command': ['/venv/bin/diff-encoder-sim', 'campaign', '--out', 'results']}
    origin = provenance(MADE._replace(manifest={'runs': [console]}, folder=tmp_path))
    assert origin['commands'] == ['diff-encoder-sim campaign --out results', f'diff-encoder-sim analyze {tmp_path}']


def test_bags_only_have_the_libraries_as_origin():
    origin = provenance(MADE)
    assert (origin['commands'], origin['runs'], origin['configuration']) == ([], [], None)
    assert origin['facts'][0][1].startswith('python ')
    assert encoder_section(MADE) is None and robot_section(MADE) is None


CHECK = {'name': 'torque', 'value': '100 %', 'is_ok': True, 'advice': ''}
ROBOT = {
    'name': 'r2',
    'file': 'r2.yaml',
    'found': [{'quantity': 'mass [kg]', 'value': '32', 'source': '<inertial>'}],
    'set': {'config.wheel_diameter': 0.1},
    'warnings': ['one wheel is flat'],
    'notes': [],
    'checks': [CHECK],
}
FAILED = {**CHECK, 'is_ok': False, 'advice': 'a stronger motor'}


def texts_of(table):
    return table.exact.values.tolist()


@pytest.mark.parametrize(
    ('checks', 'conclusion', 'checked'),
    [
        ([CHECK], 'It passed all 1 checks', [['torque', '100 %', 'ok']]),
        ([FAILED], 'Its self-check failed (torque)', [['torque', '100 %', 'NOT OK: a stronger motor']]),
        ([], 'It was not checked.', None),
    ],
)
def test_the_robot_has_its_checks_and_the_sources_of_its_values(checks, conclusion, checked):
    section = robot_section(MADE._replace(manifest={'robot': {**ROBOT, 'checks': checks}}))
    assert section['conclusion'].startswith(conclusion) and section['warnings'] == ['one wheel is flat']
    assert (section['checks'] if checked is None else texts_of(section['checks'])) == checked
    assert texts_of(section['found']) == [['mass [kg]', '32', '<inertial>']]
    assert texts_of(section['settings']) == [['config.wheel_diameter', '0.1']]


def test_each_encoder_is_a_row_with_what_its_counts_follow_from():
    amt102 = {'label': '8192 amt102', 'name': 'AMT102-V', 'price': 'industrial', 'resolution': '2048 lines x 4 = 8192'}
    amt102.update(source=['datasheet', 'manual'], counts_per_metre=13037.97)
    [row] = texts_of(encoder_section(MADE._replace(manifest={'encoders': [amt102]})))
    assert row[:3] == ['amt102 (8192 counts)', 'AMT102-V', 'industrial']
    assert row[3:] == ['2048 lines x 4 = 8192', '13038.0', 'datasheet; manual']
