"""report.html in a real browser: nothing to complain of, all to be seen, on a phone and in print."""

import numpy as np
import pytest

from browser import chromium, opened_page
from diff_encoder_sim.analysis.output_folder import REPORT
from diff_encoder_sim.analysis.outputs import write_analysis
from diff_encoder_sim.trials.trial_outcome import Outcome
from paper_datasets import cell, dataset

BROWSER = chromium()
pytestmark = pytest.mark.skipif(BROWSER is None, reason='no Chromium on this machine')

DESKTOP_PX, PHONE_PX = 1200, 390

TRIAL_NUMBERS = (
    '[...document.querySelectorAll("#trials details tbody tr")].map(row => Number(row.cells[2].textContent))'
)


@pytest.fixture(scope='module')
def report(tmp_path_factory):
    """The report of 36 trials, one of them a failure."""
    rng = np.random.default_rng(6)
    trials = [
        cell(test, ppr, 'world', rng.normal(0.0, [0.02, 0.02, 1.0], (6, 3)).tolist())
        for test in ('SL', 'SMT')
        for ppr in ('40', '1024', '4096')
    ]
    trials[0][0] = trials[0][0]._replace(outcome=Outcome.COLLISION, reason='touched <pillar_3>')
    made = dataset(*trials)
    folder = tmp_path_factory.mktemp('analysis')
    write_analysis(made, folder)
    return folder / REPORT


@pytest.fixture(scope='module')
def page(tmp_path_factory):
    with opened_page(BROWSER, tmp_path_factory.mktemp('profile')) as page:
        yield page


@pytest.mark.parametrize('width_px', [DESKTOP_PX, PHONE_PX])
def test_it_is_shown_without_a_complaint_and_without_the_net(page, report, width_px):
    page.open(report, width_px)
    assert page.complaints() == []
    asked = {request['request']['url'].partition(':')[0] for request in page.of_kind('Network.requestWillBeSent')}
    assert asked <= {'file', 'data'}


@pytest.mark.parametrize('width_px', [DESKTOP_PX, PHONE_PX])
def test_every_figure_can_be_seen(page, report, width_px):
    page.open(report, width_px)
    sizes = page.evaluate(
        '[...document.images].map(image => [image.complete, image.naturalWidth, image.clientWidth, image.clientHeight])'
    )
    assert len(sizes) > 2
    assert all(complete and natural > 0 and width > 300 and height > 100 for complete, natural, width, height in sizes)


def test_a_phone_scrolls_wide_tables_but_not_the_page(page, report):
    page.open(report, PHONE_PX)
    page.evaluate('document.querySelectorAll("details").forEach(details => details.open = true)')
    assert page.evaluate('document.documentElement.scrollWidth') <= PHONE_PX
    assert page.evaluate('[...document.querySelectorAll(".wide")].some(box => box.scrollWidth > box.clientWidth)')
    # What is read first fits.
    assert page.evaluate(
        '[...document.querySelectorAll("#summary .wide")].every(box => box.scrollWidth <= box.clientWidth)'
    )


def test_a_press_on_a_head_sorts_the_trials_and_another_turns_them(page, report):
    page.open(report, DESKTOP_PX)
    press = 'document.querySelectorAll("#trials th button")[2].click()'
    page.evaluate(press)
    assert page.evaluate(TRIAL_NUMBERS) == [number for number in range(1, 7) for _ in range(6)]
    page.evaluate(press)
    assert page.evaluate(TRIAL_NUMBERS)[:7] == [6] * 6 + [5]
    assert page.evaluate('document.querySelector("#trials [aria-sort]").ariaSort') == 'descending'


def test_it_prints_with_the_tables_unfolded_and_the_trials_left_out(page, report):
    page.open(report, DESKTOP_PX)
    page.evaluate("""addEventListener('beforeprint', () => {
        window.unfolded = [...document.querySelectorAll('details')].map((details) => details.open);
    })""")
    assert page.pdf().startswith(b'%PDF')
    is_screen = page.evaluate(
        '[...document.querySelectorAll("details")].map(details => details.matches(".screen, .folded"))'
    )
    assert page.evaluate('window.unfolded') == [not for_screen for for_screen in is_screen]
    assert not page.evaluate('[...document.querySelectorAll("details")].some(details => details.open)')
