"""advice.html in a real browser: nothing to complain of, all to be seen, and marks say what they are."""

import pytest

from advised_robots import straight_advice, whole_advice
from browser import NEEDS_BROWSER, opened_page
from diff_encoder_sim.advice.advice_page import write_page
from diff_encoder_sim.advice.odometry_study import with_budgets
from diff_encoder_sim.analysis.report.about import PageAbout, guide, wheels_text

pytestmark = NEEDS_BROWSER

BARS = 'document.querySelectorAll("#chart-budget .mark-rect path[aria-roledescription=bar]").length'
LEGENDS = '[...document.querySelectorAll("#chart-%s .role-legend-label text")].map((label) => label.textContent)'


@pytest.fixture(scope='module')
def opened(tmp_path_factory):
    """Open an advice in a window of a width; return the page."""
    path = tmp_path_factory.mktemp('advice') / 'advice.html'
    with opened_page(tmp_path_factory.mktemp('profile')) as page:

        def opened(advice, width_px=1280):
            write_page(advice, PageAbout('advise', wheels_text(0.2, 0.2, 0.4), [guide('which_encoder')]), path)
            page.open(path, width_px)
            page.wait_for('document.querySelectorAll(".charts.drawn figure svg").length === 3')
            return page

        yield opened


@pytest.mark.parametrize('width_px', [1280, 390])
def test_it_fits_and_a_dot_names_its_encoder_and_trials(opened, width_px):
    page = opened(whole_advice(), width_px)
    assert page.evaluate('document.documentElement.scrollWidth') <= width_px
    page.hover('document.querySelector("#chart-share .mark-symbol path[aria-roledescription=point]")')
    page.wait_for('document.querySelector(".tip.shown") !== null')
    tip = page.evaluate('document.querySelector(".tip.shown").innerText')
    assert 'encoder' in tip and ' of 17' in tip and page.complaints() == []


def test_without_trials_it_shows_nothing_of_trials(opened):
    texts = ['odometry at the true pose', 'pose estimate at the goal', 'true pose at the goal']
    assert opened(whole_advice()).evaluate(LEGENDS % 'share') == texts
    page = opened(with_budgets(straight_advice()))
    assert page.complaints() == []
    assert page.evaluate(LEGENDS % 'share') == texts[:1] and page.evaluate(LEGENDS % 'budget') == ['quantisation']
    assert page.evaluate('document.querySelectorAll("[name=criterion]").length') == 0 < page.evaluate(BARS)


def test_the_budget_follows_the_criterion_and_a_test_without_one_has_a_text_instead(opened):
    advice = whole_advice()
    page = opened(advice._replace(tried=[*advice.tried, advice.tried[-1]._replace(test='SMT', budget=None)]))
    of_odometry, is_text = page.evaluate(BARS), 'document.querySelector("#chart-budget svg").textContent.includes'
    page.click('document.querySelector("[name=criterion][value=\'1\']")')
    page.wait_for(f'{BARS} !== {of_odometry}')
    assert 0 < page.evaluate(BARS) < of_odometry and not page.evaluate(f'{is_text}("too few trials")')
    page.click('document.querySelector("[name=test][value=\'1\']")')
    page.wait_for(f'{is_text}("too few trials")')
    assert page.complaints() == []
