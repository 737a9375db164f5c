"""report.html in a real browser: nothing to complain of, all to be seen, on a phone and in print."""

import json

import numpy as np
import pytest

from browser import chromium, opened_page
from diff_encoder_sim.analysis.outputs import REPORT, write_analysis
from trial_tables import paper_results, trial

BROWSER = chromium()
pytestmark = pytest.mark.skipif(BROWSER is None, reason='no Chromium on this machine')

DESKTOP_PX, PHONE_PX = 1280, 390
WIDTHS_PX = [DESKTOP_PX, PHONE_PX]


X_M = np.linspace(-10.0, 10.0, 80)

DRAWN = 'document.querySelector(".charts.for-screen") !== null'
POINTS = (
    '[...document.querySelectorAll("#chart-{} .mark-symbol path")].filter(path => path.ariaRoleDescription === "point")'
)
TIP = (
    'Object.fromEntries([...document.querySelectorAll(".tip.shown dt")]'
    '.map(name => [name.textContent, name.nextSibling.textContent]))'
)
CHOSEN = 'document.querySelector("[name=trial]").selectedOptions[0].textContent'
PATH = '[...document.querySelectorAll("#chart-path .mark-line path")].map(line => line.getAttribute("d")).join()'


@pytest.fixture(scope='module')
def report(tmp_path_factory):
    """The report of 36 trials with paths, one of them a failure."""
    folder = tmp_path_factory.mktemp('analysis')
    rng = np.random.default_rng(6)
    trials = [
        both_errors(test, ppr, rng.normal(0.0, [0.02, 0.02, 1.0], (6, 3)), folder)
        for test in ('SL', 'SMT')
        for ppr in ('40', '1024', '4096')
    ]
    trials[0][0].update(outcome='collision', reason='touched <pillar_3>')
    write_analysis(paper_results(*trials), folder)
    return folder / REPORT


def both_errors(test, ppr, errors, folder):
    """Trials whose true pose and odometry end in different places; each odometry leaves straight on to its end."""
    trials = []
    for number, error in enumerate(errors, start=1):
        one = trial(test, ppr, number, world=error.tolist(), odom=(error + [0.01, 0.05, 0.5]).tolist())
        tracks = (np.column_stack((X_M, slope * (X_M + 10.0))) for slope in (0.0, 0.01 * number))
        bag = str(folder / f'{test}_{ppr}_{number}.bag')
        trials.append({**one, **dict(zip(('true_path', 'odom_path'), tracks)), 'bag': bag})
    return trials


@pytest.fixture(scope='module')
def page(tmp_path_factory):
    with opened_page(BROWSER, tmp_path_factory.mktemp('profile')) as page:
        yield page


def opened(page, report, width_px):
    page.open(report, width_px)
    page.wait_for(DRAWN)


def count(page, chart):
    return page.evaluate(f'{POINTS.format(chart)}.length')


def toggle(page, name, index):
    page.click(f'document.querySelectorAll("[name={name}]")[{index}]')


@pytest.mark.parametrize('width_px', WIDTHS_PX)
def test_it_fits_without_a_complaint_and_without_the_net(page, report, width_px):
    opened(page, report, width_px)
    page.evaluate('document.querySelectorAll("details").forEach(details => details.open = true)')
    assert page.evaluate('document.documentElement.scrollWidth') <= width_px
    drawn = 'document.querySelectorAll(".drawing svg")'
    assert page.evaluate(f'{drawn}.length') == 4
    assert page.evaluate(f'[...{drawn}].every(svg => svg.clientWidth <= svg.parentElement.clientWidth)')
    sizes = page.evaluate('[...document.images].map(image => [image.complete, image.naturalWidth, image.clientWidth])')
    assert len(sizes) > 2 and all(complete and natural > 0 and shown > 300 for complete, natural, shown in sizes)
    assert page.complaints() == []
    asked = {request['request']['url'].partition(':')[0] for request in page.of_kind('Network.requestWillBeSent')}
    assert asked <= {'file', 'data'}


def test_a_phone_scrolls_wide_tables(page, report):
    opened(page, report, PHONE_PX)
    page.evaluate('document.querySelectorAll("details").forEach(details => details.open = true)')
    assert page.evaluate('[...document.querySelectorAll(".wide")].some(box => box.scrollWidth > box.clientWidth)')
    # What is read first fits.
    assert page.evaluate(
        '[...document.querySelectorAll("#summary .wide")].every(box => box.scrollWidth <= box.clientWidth)'
    )


def test_it_prints_with_the_tables_unfolded_and_the_trials_left_out(page, report):
    opened(page, report, DESKTOP_PX)
    page.evaluate("""addEventListener('beforeprint', () => {
        window.unfolded = [...document.querySelectorAll('details')].map((details) => details.open);
    })""")
    assert page.pdf().startswith(b'%PDF')
    is_screen = page.evaluate(
        '[...document.querySelectorAll("details")].map(details => details.matches(".screen, .folded"))'
    )
    assert page.evaluate('window.unfolded') == [not for_screen for for_screen in is_screen]
    assert not page.evaluate('[...document.querySelectorAll("details")].some(details => details.open)')
    page.call('Emulation.setEmulatedMedia', media='print')
    shown = [f'getComputedStyle(document.querySelector("{part}")).display' for part in ('.charts', '.figures')]
    assert [page.evaluate(part) for part in shown] == ['none', 'block']
    page.call('Emulation.setEmulatedMedia', media='')
    page.wait_for('[...document.querySelectorAll(".drawing svg")].every(svg => svg.clientWidth > 400)')
    assert page.complaints() == []


@pytest.mark.parametrize('chart', ['scatter', 'distributions'])
def test_a_point_under_the_mouse_names_its_trial(page, report, chart):
    opened(page, report, DESKTOP_PX)
    page.hover(f'{POINTS.format(chart)}[7]')
    page.wait_for('document.querySelector(".tip.shown") !== null')
    shown = page.evaluate(TIP)
    assert shown['bag'] == f'SL_{shown["encoder"]}_{shown["trial"]}.bag' and shown['seed'] == shown['trial']
    assert {'end', 'pose', 'x [m]', 'y [m]', 'yaw [deg]'} <= shown.keys()
    page.hover('document.querySelector("h1")')
    page.wait_for('document.querySelector(".tip.shown") === null')


@pytest.mark.parametrize('width_px', WIDTHS_PX)
def test_a_point_shows_its_path(page, report, width_px):
    opened(page, report, width_px)
    before, point = page.evaluate(PATH), f'{POINTS.format("scatter")}.slice(-1)[0]'
    if width_px == PHONE_PX:
        page.call('Emulation.setTouchEmulationEnabled', enabled=True)
        page.tap(point)
        page.call('Emulation.setTouchEmulationEnabled', enabled=False)
    else:
        page.click(point)
    page.wait_for(f'{PATH} !== {json.dumps(before)}')
    assert page.evaluate(CHOSEN) == 'SL, 4096 PPR, trial 6'
    page.wait_for('document.querySelector("#chart-path").getBoundingClientRect().top < innerHeight')


def test_the_list_of_paths_follows_the_test_and_the_keyboard(page, report):
    opened(page, report, DESKTOP_PX)
    toggle(page, 'setup', 1)
    assert page.evaluate(CHOSEN) == 'SMT, 40 PPR, trial 1'
    before = page.evaluate(PATH)
    page.evaluate('document.querySelector("[name=trial]").focus()')
    for kind in ('keyDown', 'keyUp'):
        page.call('Input.dispatchKeyEvent', type=kind, key='ArrowDown', code='ArrowDown', windowsVirtualKeyCode=40)
    page.wait_for(f'{PATH} !== {json.dumps(before)}')
    assert page.evaluate(CHOSEN) == 'SMT, 40 PPR, trial 2'


def test_encoders_and_poses_are_switched_on_and_off(page, report):
    opened(page, report, DESKTOP_PX)
    assert [count(page, chart) for chart in ('scatter', 'distributions')] == [36, 36]
    toggle(page, 'encoders', 0)
    page.wait_for(f'{POINTS.format("scatter")}.length === 24')
    toggle(page, 'sources', 1)  # /odom minus goal
    page.wait_for(f'{POINTS.format("distributions")}.length === 36')
    for index in (1, 2):
        toggle(page, 'encoders', index)
    page.wait_for(f'{POINTS.format("scatter")}.length === 0')
    assert page.complaints() == []


def test_where_the_library_fails_the_figures_stay(page, report, tmp_path):
    broken = tmp_path / 'broken.html'
    broken.write_text(report.read_text(encoding='utf-8').replace('await vegaEmbed(', 'await vegaMissing('), 'utf-8')
    page.open(broken, DESKTOP_PX)
    page.wait_for('document.querySelector(".charts.drawn") === null')
    assert page.evaluate('document.querySelector(".instead-of-charts").open')
    assert 'no interactive charts' in page.complaints()[0]


def test_without_scripts_the_figures_are_shown(page, report):
    page.call('Emulation.setScriptExecutionDisabled', value=True)
    page.open(report, DESKTOP_PX)
    page.call('Emulation.setScriptExecutionDisabled', value=False)
    assert page.evaluate('document.querySelector(".charts").clientHeight') == 0
    assert page.evaluate('document.images[0].clientWidth') > 300


TRIAL_NUMBERS = (
    '[...document.querySelectorAll("#trials details tbody tr")].map(row => Number(row.cells[2].textContent))'
)


def test_a_press_on_a_head_sorts_the_trials_and_another_turns_them(page, report):
    opened(page, report, DESKTOP_PX)
    press = 'document.querySelectorAll("#trials th button")[2].click()'
    page.evaluate(press)
    assert page.evaluate(TRIAL_NUMBERS) == [number for number in range(1, 7) for _ in range(6)]
    page.evaluate(press)
    assert page.evaluate(TRIAL_NUMBERS)[:7] == [6] * 6 + [5]
    assert page.evaluate('document.querySelector("#trials [aria-sort]").ariaSort') == 'descending'


def test_a_row_of_the_trials_shows_its_path_too(page, report):
    opened(page, report, DESKTOP_PX)
    page.evaluate('document.querySelector("#trials details").open = true')
    page.click('document.querySelectorAll("#trials [data-choose]")[20]')
    assert page.evaluate(CHOSEN) == 'SMT, 40 PPR, trial 3'
    assert page.evaluate('document.querySelectorAll("[name=setup]")[1].checked')


def test_buttons_and_the_wheel_with_ctrl_zoom_and_the_wheel_alone_does_not(page, report):
    opened(page, report, DESKTOP_PX)
    labels = 'document.querySelectorAll("#chart-scatter .role-axis-label text")'
    axes = f'[...{labels}].map(label => label.textContent).sort().join()'
    whole = page.evaluate(axes)
    page.click('document.querySelector("#chart-scatter [data-factor=\'0.5\']")')
    page.wait_for(f'{axes} !== {json.dumps(whole)}')
    page.click('document.querySelector("#chart-scatter [data-factor=\'0\']")')
    page.wait_for(f'{axes} === {json.dumps(whole)}')
    wheel = (
        '(ctrlKey => !document.querySelector("#chart-scatter svg .background").dispatchEvent('
        'new WheelEvent("wheel", {bubbles: true, cancelable: true, deltaY: 100, ctrlKey})))'
    )
    assert not page.evaluate(f'{wheel}(false)') and page.evaluate(axes) == whole
    assert page.evaluate(f'{wheel}(true)')
    page.wait_for(f'{axes} !== {json.dumps(whole)}')
