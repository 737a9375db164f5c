"""advice.html in a real browser: nothing to complain of, all to be seen, and marks say what they are."""

import pytest

from advised_robots import straight_advice, whole_advice
from browser import chromium, opened_page
from diff_encoder_sim.advice.advice_page import write_page
from diff_encoder_sim.advice.odometry_study import with_budgets

BROWSER = chromium()
pytestmark = pytest.mark.skipif(BROWSER is None, reason='no Chromium on this machine')

DRAWN = 'document.querySelectorAll(".charts.drawn figure svg").length === 3'


@pytest.fixture(scope='module')
def page(tmp_path_factory):
    advice = tmp_path_factory.mktemp('advice') / 'advice.html'
    write_page(whole_advice(), advice)
    with opened_page(BROWSER, tmp_path_factory.mktemp('profile')) as page:
        yield lambda width_px: (page.open(advice, width_px), page.wait_for(DRAWN), page)[-1]


@pytest.mark.parametrize('width_px', [1280, 390])
def test_it_fits_and_complains_of_nothing(page, width_px):
    opened = page(width_px)
    assert opened.complaints() == []
    assert opened.evaluate('document.documentElement.scrollWidth') <= width_px


def test_a_dot_names_its_encoder_and_trials(page):
    opened = page(1280)
    opened.hover('document.querySelector("#chart-share .mark-symbol path[aria-roledescription=point]")')
    opened.wait_for('document.querySelector(".tip.shown") !== null')
    tip = opened.evaluate('document.querySelector(".tip.shown").innerText')
    assert 'encoder' in tip and ' of 17' in tip


def test_the_budget_follows_the_choice_of_criterion(page):
    opened = page(1280)
    bars = 'document.querySelectorAll("#chart-budget .mark-rect path[aria-roledescription=bar]").length'
    of_odometry = opened.evaluate(bars)
    opened.click('document.querySelector("[name=criterion][value=\'1\']")')
    opened.wait_for(f'{bars} !== {of_odometry}')
    assert 0 < opened.evaluate(bars) < of_odometry


LEGENDS = '[...document.querySelectorAll("#chart-%s .role-legend-label text")].map((label) => label.textContent)'


def test_without_trials_it_shows_nothing_of_trials(page, tmp_path):
    opened = page(1280)
    assert opened.evaluate(LEGENDS % 'share') == [
        'odometry at the true pose',
        'pose estimate at the goal',
        'true pose at the goal',
    ]
    write_page(with_budgets(straight_advice()), tmp_path / 'advice.html')
    opened.open(tmp_path / 'advice.html', 1280)
    opened.wait_for(DRAWN)
    assert opened.complaints() == []
    assert opened.evaluate(LEGENDS % 'share') == ['odometry at the true pose']
    assert opened.evaluate(LEGENDS % 'budget') == ['quantisation']
    assert opened.evaluate('document.querySelectorAll("[name=criterion]").length') == 0
    assert opened.evaluate(
        'document.querySelectorAll("#chart-budget .mark-rect path[aria-roledescription=bar]").length'
    )


def test_a_test_without_a_budget_of_the_true_pose_has_a_text_in_its_place(page, tmp_path):
    advice = whole_advice()
    other = advice.tried[-1]._replace(test='SMT', truth=None)
    write_page(advice._replace(tried=[*advice.tried, other]), tmp_path / 'advice.html')
    opened = page(1280)
    opened.open(tmp_path / 'advice.html', 1280)
    opened.wait_for(DRAWN)
    said = 'document.querySelector("#chart-budget svg").textContent.includes("too few trials")'
    opened.click('document.querySelector("[name=criterion][value=\'1\']")')
    assert opened.evaluate(said) is False
    opened.click('document.querySelector("[name=test][value=\'1\']")')
    opened.wait_for(said)
    assert opened.complaints() == []
