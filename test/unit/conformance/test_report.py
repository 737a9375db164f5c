"""Verdicts in the terminal, as JUnit XML and as a page: of this package's odometry, and of a wrong one."""

import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from browser import NEEDS_BROWSER, opened_page
from diff_encoder_sim.analysis.charts import chart_page
from diff_encoder_sim.conformance import conformance_page, report
from diff_encoder_sim.conformance.cases import plan
from diff_encoder_sim.conformance.mapping import Wheels
from diff_encoder_sim.conformance.verdicts import judge
from odometry_subjects import COUNTS, OurOdometry, evidence_of, mapping_of

X_ERROR = np.append(1.1, np.ones(84))
FAILED = ['2.5', '6.4', '6.5']


@pytest.fixture(scope='module')
def judged():
    """Evidence and verdicts of the 30 motions: all right, and an arc with a wrong pose and frame."""
    first = plan(mapping_of(COUNTS), Wheels())[0]
    motions = first._replace(cases=[case for case in first.cases if case.is_motion])
    right = evidence_of(OurOdometry, rounds=[motions])
    arc = next(each for each in right.recordings if each.name == 'arc left, 0.5 m')
    odometry = [each._replace(frame='od\x01m', numbers=each.numbers * X_ERROR) for each in arc.odometry]
    wrong = [each._replace(odometry=odometry) if each is arc else each for each in right.recordings]
    return [(evidence, judge(evidence)) for evidence in (right, right._replace(recordings=wrong))]


def test_the_table_has_all_clauses_the_effect_of_each_fault_and_the_counts(judged, monkeypatch):
    monkeypatch.setenv('COLUMNS', '40')
    _, verdicts = judged[1]
    table, ending = report.verdict_table(verdicts).split('\n\n')
    assert max(map(len, table.splitlines())) <= 120
    assert re.findall(r'^\d\.\d', table, re.M) == [each.clause.number for each in verdicts]
    *effects, last = ending.splitlines()
    assert [line[:3] for line in effects] == FAILED and 'Odometry leaves the path' in effects[0]
    counts = re.fullmatch(r'(\d+) pass, 3 fail, (\d+) not applicable', last)
    assert int(counts[1]) + int(counts[2]) + 3 == len(verdicts)


def test_rosunit_and_others_read_the_junit_xml(judged, tmp_path):
    (_, verdicts), path = judged[1], tmp_path / 'conformance.xml'
    path.write_bytes(report.junit_xml(verdicts, 'my_node', 12.5))
    suite = ElementTree.parse(path).getroot()
    numbers = [len(verdicts), 3, 0, len(suite.findall('testcase/skipped'))]
    assert [int(suite.get(key)) for key in ('tests', 'failures', 'errors', 'skipped')] == numbers
    assert [case.get('name')[:3] for case in suite if case.find('failure') is not None] == FAILED
    result = pytest.importorskip('rosunit.junitxml').read(str(path), 'suite')
    assert (result.num_tests, result.num_failures, result.num_errors, result.time) == (len(verdicts), 3, 0, 12.5)
    failed = [case.description for case in result.test_case_results if case.failures]
    assert 'allowed: ' in failed[0] and r'od\x01m -> base_link' in failed[2]


@NEEDS_BROWSER
@pytest.mark.parametrize('width_px', [1280, 390])
def test_the_page_shows_a_failed_case_first_and_is_not_cut(width_px, judged, tmp_path, monkeypatch):
    monkeypatch.setattr(chart_page, 'VALIDATE', True)
    conformance_page.write_page(*judged[1], 'conformance_node', tmp_path / 'page.html')
    with opened_page(tmp_path / 'profile') as page:
        page.open(tmp_path / 'page.html', width_px)
        page.wait_for('document.querySelectorAll(".charts.drawn figure svg").length === 1')
        assert page.evaluate('document.documentElement.scrollWidth') <= width_px
        assert page.evaluate('document.querySelector("[name=drive]").selectedOptions[0].text').endswith('(fails 2.5)')
        assert page.cut_texts() == page.complaints() == []


def test_the_page_has_both_paths_of_all_motions_and_is_small(judged, tmp_path):
    conformance_page.write_page(*judged[0], 'conformance_node', tmp_path / 'page.html')
    text = (tmp_path / 'page.html').read_text(encoding='utf-8')
    content = json.loads(re.search(r'<script type="application/json">(.*?)</script>', text, re.S)[1])
    rows = max(content['data'].values(), key=lambda columns: len(columns['drive']))
    ends = {(drive, kind): (x, y) for drive, kind, x, y in zip(*(rows[key] for key in ('drive', 'is_exact', 'x', 'y')))}
    assert len(ends) == 2 * 30
    for (drive, _), end_m in ends.items():
        assert end_m == pytest.approx(ends[drive, True], abs=1e-3)
    assert 'The odometry passes all ' in text and len(rows['drive']) < 4000


def test_a_node_without_odometry_has_a_page_without_charts(judged, tmp_path):
    evidence = judged[0][0]._replace(recordings=[], unusable='/odom: no message')
    conformance_page.write_page(evidence, judge(evidence), 'conformance_node', tmp_path / 'page.html')
    text = (tmp_path / 'page.html').read_text(encoding='utf-8')
    assert '<h2>Charts</h2>' not in text and '/odom: no message' in text
