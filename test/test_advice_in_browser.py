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
    assert page.evaluate('document.documentElement.scrollWidth') <= width_px and page.cut_texts() == []
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


def test_the_nearest_point_of_the_curve_has_a_tooltip(opened):
    page = opened(whole_advice())
    chart = 'document.querySelector("#chart-share svg")'
    page.hover(chart)
    page.wait_for('document.querySelector(".tip.shown") !== null')
    counts, share, samples = page.evaluate(
        '[...document.querySelectorAll(".tip.shown dd")].map((dd) => dd.textContent)'
    )
    errors = whole_advice().curves.curves[0].errors[float(counts)]
    within = whole_advice().requirement.within(errors).mean()
    assert (share, samples) == (f'{100.0 * within:.1f}%', str(len(errors)))


def test_it_is_dark_on_a_dark_screen_and_light_on_paper(opened):
    page, colours = opened(whole_advice()), []
    for media, scheme in (('screen', 'light'), ('screen', 'dark'), ('print', 'dark')):
        page.call(
            'Emulation.setEmulatedMedia', media=media, features=[{'name': 'prefers-color-scheme', 'value': scheme}]
        )
        of_page = 'getComputedStyle(document.body).backgroundColor'
        of_chart = 'getComputedStyle(document.querySelector("#chart-share .role-axis-label text")).fill'
        colours.append(page.evaluate(f'[{of_page}, {of_chart}]'))
    page.call('Emulation.setEmulatedMedia', media='', features=[])
    (light, ink), (dark, pale), paper = colours
    assert paper == [light, ink] == ['rgb(255, 255, 255)', 'rgb(27, 31, 36)'] and dark != light and pale != ink
