"""The documentation builds without a warning and without a network; its pages and the README name what exists."""

import importlib.util
import os
import re
import subprocess
import sys

import pytest
import yaml

from browser import NEEDS_BROWSER, opened_page
from diff_encoder_sim.trials.campaign_cells import CampaignParams
from documented_commands import fences, pages
from places import ROOT

DOCS, PACKAGE = ROOT / 'docs', ROOT / 'src' / 'diff_encoder_sim'
QUESTIONS = DOCS / 'questions.md'
RECORDS = sorted((DOCS / 'adr').glob('0*.md'))
RECORD = re.compile(r'# \d{4}: (.+)\n\nStatus: (accepted), (\d{4}-\d\d-\d\d)\n\n')
PARTS = ['Context', 'Decision', 'Consequences']
LINK = re.compile(r'\]\(([^)#:]+)(?:#[^)]*)?\)')
FILE = re.compile(r'(?<!`)`((?:[\w-]+/)*[\w-]+\.(?:py|sh|launch|world|csv|json|md))`')
PLACEHOLDER = re.compile('[A-Z]{4}|^(results|tables)/')
WRITTEN_BY_COMMANDS = {'advice.json', 'trials.csv', 'manifest.json', 'reencode.csv'}
OF_OTHERS = {'encoder.csv', 'wheels.csv', 'amcl.launch'}  # KAIST's, NCLT's, TurtleBot3's
FROM_ELSEWHERE = re.compile(
    r'<(?:script|img|iframe)[^>]+src="(?:https?:)?//|<link[^>]+rel="stylesheet"[^>]+href="(?:https?:)?//'
)


@pytest.fixture(scope='module')
def site(tmp_path_factory):
    """Return the folder of the built site; a warning of Sphinx is a failure."""
    if importlib.util.find_spec('sphinx') is None:
        # ROSTESTS_REQUIRED is set where all can be had; Python 3.8 has no such Sphinx
        is_required = os.environ.get('ROSTESTS_REQUIRED') and sys.version_info >= (3, 11)
        assert not is_required, 'no Sphinx: requirements-docs.txt'
        pytest.skip('Sphinx is not installed: scripts/setup.sh --test')
    folder = tmp_path_factory.mktemp('docs')
    command = [sys.executable, '-m', 'sphinx', '-q', '-W', '--keep-going', '-b', 'html', DOCS, folder / 'site']
    build = subprocess.run([*command, '-d', folder / 'doctrees'], capture_output=True, text=True, cwd=folder)
    assert build.returncode == 0, build.stdout + build.stderr
    return folder / 'site'


@pytest.mark.timeout(280)
def test_the_pages_of_the_site_load_nothing_from_elsewhere(site):
    built = list(site.rglob('*.html'))
    assert len(built) > 40
    assert [page.name for page in built if FROM_ELSEWHERE.search(page.read_text())] == []


@NEEDS_BROWSER
@pytest.mark.timeout(280)
def test_the_search_shows_guides_before_decisions(site, tmp_path):
    with opened_page(tmp_path) as browser:
        browser.open(site / 'search.html', 1280)
        browser.wait_for('Search.hasIndex()')
        for words, guide in (('covariance', 'encoders'), ('encoder', 'which_encoder'), ('drift turns', 'questions')):
            query = f'Search._performSearch(...Search._parseQuery("{words}"))'
            found = [result[0] for result in reversed(browser.evaluate(query))]  # the last one is shown first
            others = [number for number, name in enumerate(found) if name.startswith(('adr/', 'api/', 'changelog'))]
            assert found.index(guide) < min(others, default=len(found)), found


def test_the_campaign_files_that_are_shown_are_allowed():
    found = fences((DOCS / 'campaigns.md').read_text().splitlines())
    shown = [fence.lines for fence in found if fence.language == 'yaml']
    assert len(shown) == 2
    for lines in shown:
        CampaignParams.from_mapping(yaml.safe_load('\n'.join(lines)), 'campaigns.md')


@pytest.mark.parametrize('page', pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_links_and_files_on_a_page_exist(page):
    text = page.read_text()
    # api/ is made when the site is built
    missing = [link for link in LINK.findall(text) if not ((page.parent / link).exists() or link.startswith('api/'))]
    names = {path.name for folder in ('src', 'test', 'config', 'launch') for path in (ROOT / folder).rglob('*.*')}
    for name in FILE.findall(text):
        is_there = (ROOT / name).exists() or (PACKAGE / name).exists() or name in names
        if not (is_there or name in WRITTEN_BY_COMMANDS | OF_OTHERS or PLACEHOLDER.search(name)):
            missing.append(name)
    assert missing == []


def anchors(page):
    """Return the anchors of the headings of a page, on GitHub and on the site."""
    headings = re.findall('(?m)^#+ (.+)$', re.sub('(?s)```.*?```', '', page.read_text()))
    return [re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings]


@pytest.mark.parametrize('page', [ROOT / 'README.md', QUESTIONS], ids=lambda page: page.stem)
def test_links_to_sections_lead_to_their_headings(page):
    links = re.findall(r'\]\(([\w/]*(?:\.md)?)#([\w-]+)\)', page.read_text())
    assert len(links) > 5
    assert [link for link in links if link[1] not in anchors(page.parent / link[0] if link[0] else page)] == []


def test_the_readme_leads_to_each_common_question_which_has_a_command_and_a_guide():
    sections = re.split('(?m)^## ', QUESTIONS.read_text())[1:]
    assert len(sections) >= 7
    for anchor, section in zip(anchors(QUESTIONS)[1:], sections):
        assert f'](docs/questions.md#{anchor})' in (ROOT / 'README.md').read_text()
        assert '```bash\n' in section and re.search(r'\]\(\w+\.md', section), anchor


@pytest.mark.parametrize('record', RECORDS, ids=lambda record: record.stem)
def test_a_decision_record_has_the_parts_of_the_template_and_stands_in_the_list(record):
    text = record.read_text()
    match = RECORD.match(text)
    assert match, 'expected as in docs/adr/README.md'
    assert re.findall(r'(?m)^## (.+)$', text) == PARTS
    title, status, date = match.groups()
    row = f'| [{record.name[:4]}]({record.name}) | {title} | {status} | {date} |'
    assert row in (DOCS / 'adr' / 'README.md').read_text()
