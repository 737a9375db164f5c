"""The block about a page: its command, its wheels, and links to what exists."""

import re
import sys
from pathlib import Path

import pytest

from diff_encoder_sim.analysis.report import about
from diff_encoder_sim.analysis.report.about import Link, PageAbout, guide, robot_file, save_page, wheels_text
from diff_encoder_sim.drives.test_definition import TestDefinition, load_test
from places import ROOT


def block_of(content, folder):
    save_page(folder / 'page.html', Path(about.__file__).with_name('about.html'), content)
    return (folder / 'page.html').read_text(encoding='utf-8')


@pytest.mark.parametrize(
    ('arguments', 'shown'),
    [
        (
            ['/ws/scripts/advise', '--robot', 'my robot.yaml'],
            'rosrun diff_encoder_sim advise --robot &#39;my robot.yaml',
        ),
        (['/venv/bin/diff-encoder-sim', 'advise', '--out', 'a'], '<code>diff-encoder-sim advise --out a </code>'),
        (['/venv/bin/jupyter', 'kernel'], None),
    ],
)
def test_it_has_the_command_as_typed_if_there_is_one(arguments, shown, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, 'argv', arguments)
    text = block_of(PageAbout('advise', wheels_text(0.2, 0.21, 0.4, 'exact wheels')), tmp_path)
    assert 'diameter 0.2 m (left), 0.21 m (right), separation 0.4 m; exact wheels' in text
    assert shown in re.sub('</?span>', '', text) if shown else '<dt>command' not in text


def test_links_are_relative_and_name_the_command_of_a_file_that_is_still_to_be_written(tmp_path):
    links = [*robot_file(str(ROOT / 'config' / 'robots' / 'alto.yaml')), *robot_file(''), *robot_file('absent.yaml')]
    assert [link.text for link in links] == ['Robot file alto.yaml']
    links.append(Link('Report', tmp_path / 'a b' / 'report.html', 'analyze a'))
    (tmp_path / 'advice').mkdir()
    text = block_of(PageAbout('advise', '', links), tmp_path / 'advice')
    assert 'href="../a%20b/report.html">Report</a> <span class="soft">(written by <code>analyze a</code>)' in text


def test_guides_lead_to_the_site_else_to_markdown_else_are_only_named(tmp_path, monkeypatch):
    monkeypatch.setattr(about, 'package_folder', lambda: tmp_path)
    assert guide('which_encoder') == Link('Which encoder (docs/which_encoder.md)')
    for page in (tmp_path / 'docs' / 'which_encoder.md', tmp_path / '.ws' / 'docs' / 'which_encoder.html'):
        page.parent.mkdir(parents=True)
        page.touch()
        assert guide('which_encoder') == Link('Which encoder', page)


@pytest.mark.parametrize(
    ('name', 'text'),
    [
        ('SL', '20 m straight in the world hallway'),
        ('SMT', '5 turns in place in the world ros_logo'),
        ('DLD', '93.2 m past 40 waypoints in the world ros_logo'),
        ('UMBMARK', '32 m in 8 parts and 2.25 turns in the world open_floor'),
    ],
)
def test_a_test_is_explained_by_its_motion(name, text):
    assert load_test(name, ROOT / 'config').text == text


def test_a_test_without_motion_is_at_rest():
    assert TestDefinition(name='rest', world='hall', drive=[{'stop': 3.0}]).text == 'rest in the world hall'
