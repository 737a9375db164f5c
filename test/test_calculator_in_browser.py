"""The calculator of the documentation in a real browser: it computes what advise does, and shows mistakes."""

import math
import os
import re
import shutil
import subprocess
import sys
from statistics import NormalDist
from urllib.parse import parse_qsl

import numpy as np
import pytest

from browser import NEEDS_BROWSER, opened_page
from diff_encoder_sim.advice.answers import Requirement
from diff_encoder_sim.advice.odometry_answer import closed_form_counts
from diff_encoder_sim.analysis.closed_form import closed_form_std
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.api.recorded_advice import robot_of_numbers
from diff_encoder_sim.cli.advise import parse
from diff_encoder_sim.robots.wheel_quality import QUALITIES
from drawn_drives import encoder_of
from places import ROOT

pytestmark = NEEDS_BROWSER

KEYS = ('wheel-diameter', 'wheel-separation', 'distance', 'turns', 'ppr', 'wheels')
SETTINGS = [
    (0.2, 0.45, 10, 1, 128, 'exact'),
    (0.2, 0.45, 10, 1, 1024, 'calibrated'),
    (0.2, 0.4, 20, 5, 360, 'exact'),
    (0.066, 0.16, 3, 2.5, 48, 'exact'),
    (0.033, 0.09, 1, 0.1, 12, 'exact'),
    (0.125, 0.3, 6, 0, 96, 'calibrated'),
    (0.316, 0.56, 4, 3, 90, 'measured'),
    (0.6, 1.5, 40, 2, 2578.33, 'calibrated'),
    (0.1, 0.25, 2, 10, 64, 'uncalibrated'),
    (0.5, 0.7, 5, 20, 40, 'exact'),
]
SAMPLES, DRAWS = 500, 2000  # of the page, of this test
LEVEL = 0.99  # of all comparisons together
ACROSS, YAW = 1, 2
STATE = 'document.getElementById("calculator-box").getAttribute("aria-busy")'
TEXT = 'document.getElementById("%s").innerText'
VALUES = 'Array.from(document.querySelectorAll("#%s [data-value]"), (each) => +each.dataset.value)'
SLIDE = """((slider) => {
    slider.value = slider.max;
    for (const kind of ["input", "change"]) slider.dispatchEvent(new Event(kind, {bubbles: true}));
})(document.querySelector("[data-of=%s]"))"""


@pytest.fixture(scope='module')
def site(tmp_path_factory):
    """The page with its theme, built without the rest of the documentation."""
    pytest.importorskip('sphinx')
    source, site = tmp_path_factory.mktemp('source'), tmp_path_factory.mktemp('site')
    shutil.copy(ROOT / 'docs' / 'calculator.md', source)
    settings = [
        *('extensions=myst_parser,calculator', 'root_doc=calculator', 'suppress_warnings=myst.xref_missing'),
        *('html_theme=furo', f'html_static_path={ROOT / "docs" / "_static"}', 'html_css_files=site.css'),
    ]
    given = [part for setting in settings for part in ('-D', setting)]
    paths = os.pathsep.join([str(ROOT / 'src'), str(ROOT / 'docs' / '_ext')])
    command = [sys.executable, '-m', 'sphinx', '-q', '-C', *given, '-b', 'html', str(source), str(site)]
    subprocess.run(command, env={**os.environ, 'PYTHONPATH': paths}, check=True)
    return site / 'calculator.html'


@pytest.fixture(scope='module')
def page(tmp_path_factory):
    with opened_page(tmp_path_factory.mktemp('profile')) as page:
        yield page


def show(page, setting):
    """Open a link to a setting."""
    page.evaluate(f'location.hash = "{"&".join(map("=".join, zip(KEYS, map(str, setting))))}"')
    page.wait_for(f'document.querySelector("[name=ppr]").value === "{setting[KEYS.index("ppr")]}"')


def advised(arguments):
    """The robot's geometry, its counts, and its drives on wheels of the quality, by the arguments of advise."""
    options = parse(arguments)
    draws = robot_of_numbers(options).by_wheels()[QUALITIES[options.wheels]]
    return RobotGeometry(options.wheel_diameter, options.wheel_separation), options.ppr[0], draws


def test_ten_settings_give_what_advise_computes(site, page):
    page.open(site, 1280)
    requirement, z = Requirement(), NormalDist().inv_cdf(1.0 - 0.5 * (1.0 - LEVEL) / (2 * len(SETTINGS)))
    for setting in SETTINGS:
        show(page, setting)
        # The command that the page shows is what is computed here.
        _, _, command, *arguments = page.evaluate(TEXT % 'command').split()
        assert command == 'advise' and sorted(arguments[1::2]) == sorted(map(str, setting))
        robot, counts, tests = advised(arguments)
        rates, lowest = page.evaluate(VALUES % 'chosen'), page.evaluate(VALUES % 'closed-form')
        rows = iter(np.reshape(page.evaluate(VALUES % 'errors'), (-1, 4)))
        assert len(rates) == len(lowest) == len(tests) == (2 if setting[KEYS.index('turns')] else 1)
        for draws, rate, needed in zip(tests, rates, lowest):
            requested, (errors, of_wheels) = draws.drive.requested, draws.errors([encoder_of(counts), None], DRAWS)
            assert needed == pytest.approx(closed_form_counts(requested, robot, requirement), rel=0.01), setting
            within = requirement.within(errors)
            both = (within.sum() + rate * SAMPLES) / (DRAWS + SAMPLES)
            margin = z * math.sqrt(both * (1.0 - both) * (1.0 / DRAWS + 1.0 / SAMPLES))
            assert abs(rate - within.mean()) <= margin, (setting, rate, within.mean())
            for axis in (ACROSS, YAW) if requested.goal().x_m else (YAW,):
                by_counts, by_wheels, sampled, allowed = next(rows)
                assert by_counts == pytest.approx(closed_form_std(requested, robot, counts)[axis], rel=0.01), setting
                assert allowed == requirement.tolerances[axis]
                std, std_of_wheels = errors[:, axis].std(), of_wheels[:, axis].std()
                assert sampled == pytest.approx(std, rel=z * math.sqrt(0.5 / SAMPLES + 0.5 / DRAWS)), setting
                # First order in the errors of the wheels.
                assert by_wheels == pytest.approx(std_of_wheels, rel=z * math.sqrt(0.5 / DRAWS), abs=1e-9), setting
    assert page.complaints() == []


@pytest.mark.parametrize('width_px', [1280, 390])
def test_it_fits_answers_and_follows_the_sliders(site, page, width_px):
    page.open(site, width_px)
    show(page, SETTINGS[0])
    page.wait_for(f'{STATE} === "false" && {TEXT % "answer"}.startsWith("At least")')
    likely, fewer, enough = map(
        int, re.findall(r'(\d+) counts.*between (\d+) and (\d+)', page.evaluate(TEXT % 'answer'))[0]
    )
    assert fewer <= likely <= enough and fewer <= page.evaluate(VALUES % 'closed-form')[0] <= enough
    assert page.evaluate('document.documentElement.scrollWidth') <= width_px
    for key in KEYS[:-1]:
        page.evaluate(SLIDE % key)
    values = [page.evaluate(f'document.querySelector("[name={key}]").value') for key in KEYS]
    assert values == ['0.6', '1.5', '100', '20', '65536', 'exact']
    assert dict(parse_qsl(page.evaluate('location.hash').lstrip('#'))) == dict(zip(KEYS, values))
    assert page.complaints() == []


def test_the_wheels_are_the_limit_and_a_mistake_is_one_line(site, page):
    page.open(site, 1280)
    show(page, SETTINGS[1])
    page.wait_for(f'{STATE} === "false" && {TEXT % "answer"}.startsWith("The encoder is not the limit")')
    for key, given, allowed in [
        ('ppr', '7', '8 to 65536'),
        ('distance', '', '0.1 to 1000'),
        ('wheels', 'x', 'exact, '),
    ]:
        page.evaluate(f'location.hash = "{key}={given}"')
        page.wait_for(
            f'{TEXT % "answer"}.startsWith("{key}: given ") && {TEXT % "answer"}.includes("allowed: {allowed}")'
        )
        show(page, SETTINGS[1])
        page.wait_for(f'{STATE} === "false" && {TEXT % "answer"}.startsWith("The encoder is not the limit")')
    assert page.complaints() == []
