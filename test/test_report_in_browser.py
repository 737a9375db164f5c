"""report.html in a real browser: nothing to complain of, all to be seen, on a phone and in print."""

import itertools
import json

import numpy as np
import pytest

from browser import NEEDS_BROWSER, opened_page
from diff_encoder_sim.analysis.charts import figures
from diff_encoder_sim.analysis.outputs import REPORT, write_analysis
from diff_encoder_sim.drives.topics import PoseSource
from trial_tables import paper_results, trial

pytestmark = NEEDS_BROWSER

DESKTOP_PX, PHONE_PX = 1280, 390
X_M = np.linspace(-10.0, 10.0, 80)

POINTS = (
    '[...document.querySelectorAll("#chart-{} .mark-symbol path")].filter(path => path.ariaRoleDescription === "point")'
)
TIP = (
    'Object.fromEntries([...document.querySelectorAll(".tip.shown dt")]'
    '.map(name => [name.textContent, name.nextSibling.textContent]))'
)
CHOSEN = 'document.querySelector("[name=trial]").selectedOptions[0].textContent'
PATH = '[...document.querySelectorAll("#chart-path .mark-line path")].map(line => line.getAttribute("d")).join()'
OPEN_ALL = 'document.querySelectorAll("details").forEach(details => details.open = true)'


@pytest.fixture(scope='module')
def report(tmp_path_factory):
    """The report of 36 trials with paths, one of them a failure; each odometry leaves straight on to its end."""
    folder, rng, trials = tmp_path_factory.mktemp('analysis'), np.random.default_rng(6), []
    for test, ppr in itertools.product(('SL', 'SMT'), ('40', '1024', '4096')):
        for number, error in enumerate(rng.normal(0.0, [0.02, 0.02, 1.0], (6, 3)), start=1):
            tracks = [np.column_stack((X_M, slope * (X_M + 10.0))) for slope in (0.0, 0.01 * number)]
            poses = {'world': error.tolist(), 'odom': (error + [0.01, 0.05, 0.5]).tolist()}
            named = dict(zip(('true_path', 'odom_path'), tracks), bag=str(folder / f'{test}_{ppr}_{number}.bag'))
            trials.append(trial(test, ppr, number, **poses, **named))
    trials[0].update(outcome='collision', reason='touched <pillar_3>')
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, 'TOPIC_OF_SOURCE', {PoseSource.WORLD: '/world_pose'})  # fewer, as drawing takes long
        write_analysis(paper_results(trials), folder)
    return folder / REPORT


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    with opened_page(tmp_path_factory.mktemp('profile')) as page:
        yield page


@pytest.fixture
def page(browser, report, request):
    browser.open(report, getattr(request, 'param', DESKTOP_PX))
    browser.wait_for('document.querySelector(".charts.for-screen") !== null')
    return browser


def toggle(page, name, index):
    page.click(f'document.querySelectorAll("[name={name}]")[{index}]')


@pytest.mark.parametrize('page', [DESKTOP_PX, PHONE_PX], indirect=True)
def test_it_fits_without_a_complaint_and_without_the_net_and_wide_tables_scroll(page):
    width_px = page.evaluate('innerWidth')
    page.evaluate(OPEN_ALL)
    assert page.evaluate('document.documentElement.scrollWidth') <= width_px and page.cut_texts() == []
    drawn = 'document.querySelectorAll(".drawing svg")'
    assert page.evaluate(f'{drawn}.length') == 4
    assert page.evaluate(f'[...{drawn}].every(svg => svg.clientWidth <= svg.parentElement.clientWidth)')
    sizes = page.evaluate('[...document.images].map(image => [image.complete, image.naturalWidth, image.clientWidth])')
    assert len(sizes) > 2 and all(complete and natural > 0 and shown > 300 for complete, natural, shown in sizes)
    assert page.complaints() == []
    asked = {request['request']['url'].partition(':')[0] for request in page.of_kind('Network.requestWillBeSent')}
    assert asked <= {'file', 'data'}
    scrolls = '[...document.querySelectorAll("{} .wide")].some(box => box.scrollWidth > box.clientWidth)'
    assert page.evaluate(scrolls.format('')) or width_px > PHONE_PX
    assert not page.evaluate(scrolls.format('#summary'))  # what is read first fits


def test_it_prints_with_the_tables_unfolded_and_the_trials_left_out(page):
    page.evaluate("""addEventListener('beforeprint', () => {
        window.unfolded = [...document.querySelectorAll('details')].map((details) => details.open);
    })""")
    assert page.pdf().startswith(b'%PDF')
    is_screen = '[...document.querySelectorAll("details")].map(details => details.matches(".screen, .folded"))'
    assert page.evaluate('window.unfolded') == [not for_screen for for_screen in page.evaluate(is_screen)]
    assert not page.evaluate('[...document.querySelectorAll("details")].some(details => details.open)')
    page.call('Emulation.setEmulatedMedia', media='print')
    shown = [f'getComputedStyle(document.querySelector("{part}")).display' for part in ('.charts', '.figures')]
    assert [page.evaluate(part) for part in shown] == ['none', 'block']
    page.call('Emulation.setEmulatedMedia', media='')
    page.wait_for('[...document.querySelectorAll(".drawing svg")].every(svg => svg.clientWidth > 400)')
    assert page.complaints() == []


def test_a_point_under_the_mouse_names_its_trial(page):
    for chart in ('scatter', 'distributions'):
        page.hover(f'{POINTS.format(chart)}[7]')
        page.wait_for('document.querySelector(".tip.shown") !== null')
        shown = page.evaluate(TIP)
        assert shown['bag'] == f'SL_{shown["encoder"]}_{shown["trial"]}.bag' and shown['seed'] == shown['trial']
        assert {'end', 'pose', 'x [m]', 'y [m]', 'yaw [deg]'} <= shown.keys()
        page.hover('document.querySelector("h1")')
        page.wait_for('document.querySelector(".tip.shown") === null')


@pytest.mark.parametrize('page', [DESKTOP_PX, PHONE_PX], indirect=True)
def test_a_point_shows_its_path(page):
    before, point = page.evaluate(PATH), f'{POINTS.format("scatter")}.slice(-1)[0]'
    if page.evaluate('innerWidth') == PHONE_PX:
        page.call('Emulation.setTouchEmulationEnabled', enabled=True)
        page.tap(point)
        page.call('Emulation.setTouchEmulationEnabled', enabled=False)
    else:
        page.click(point)
    page.wait_for(f'{PATH} !== {json.dumps(before)}')
    assert page.evaluate(CHOSEN) == 'SL, 4096 counts, trial 6'
    page.wait_for('document.querySelector("#chart-path").getBoundingClientRect().top < innerHeight')


def test_the_list_of_paths_follows_the_test_the_keyboard_and_the_table(page):
    toggle(page, 'setup', 1)
    assert page.evaluate(CHOSEN) == 'SMT, 40 counts, trial 1'
    before = page.evaluate(PATH)
    page.evaluate('document.querySelector("[name=trial]").focus()')
    for kind in ('keyDown', 'keyUp'):
        page.call('Input.dispatchKeyEvent', type=kind, key='ArrowDown', code='ArrowDown', windowsVirtualKeyCode=40)
    page.wait_for(f'{PATH} !== {json.dumps(before)}')
    assert page.evaluate(CHOSEN) == 'SMT, 40 counts, trial 2'
    page.evaluate('document.querySelector("#trials details").open = true')
    page.click('document.querySelectorAll("#trials [data-choose]")[2]')
    assert page.evaluate(CHOSEN) == 'SL, 40 counts, trial 3'
    assert page.evaluate('document.querySelectorAll("[name=setup]")[0].checked')


def test_encoders_and_poses_are_switched_on_and_off(page):
    assert [page.evaluate(f'{POINTS.format(chart)}.length') for chart in ('scatter', 'distributions')] == [36, 36]
    toggle(page, 'encoders', 0)
    page.wait_for(f'{POINTS.format("scatter")}.length === 24')
    toggle(page, 'sources', 1)  # /odom minus goal
    page.wait_for(f'{POINTS.format("distributions")}.length === 36')
    for index in (1, 2):
        toggle(page, 'encoders', index)
    page.wait_for(f'{POINTS.format("scatter")}.length === 0')
    assert page.complaints() == []


def test_without_the_library_or_scripts_the_figures_stay(browser, report, tmp_path):
    broken = tmp_path / 'broken.html'
    broken.write_text(report.read_text(encoding='utf-8').replace('await vegaEmbed(', 'await vegaMissing('), 'utf-8')
    browser.open(broken, DESKTOP_PX)
    browser.wait_for('document.querySelector(".charts.drawn") === null')
    assert browser.evaluate('document.querySelector(".instead-of-charts").open')
    assert 'no interactive charts' in browser.complaints()[0]
    browser.call('Emulation.setScriptExecutionDisabled', value=True)
    browser.open(report, DESKTOP_PX)
    browser.call('Emulation.setScriptExecutionDisabled', value=False)
    assert browser.evaluate('document.querySelector(".charts").clientHeight') == 0
    assert browser.evaluate('document.images[0].clientWidth') > 300


def test_a_press_on_a_head_sorts_the_trials_and_another_turns_them(page):
    press = 'document.querySelectorAll("#trials th button")[2].click()'
    numbers = '[...document.querySelectorAll("#trials details tbody tr")].map(row => Number(row.cells[2].textContent))'
    page.evaluate(press)
    assert page.evaluate(numbers) == [number for number in range(1, 7) for _ in range(6)]
    page.evaluate(press)
    assert page.evaluate(numbers)[:7] == [6] * 6 + [5]
    assert page.evaluate('document.querySelector("#trials [aria-sort]").ariaSort') == 'descending'


def test_buttons_and_the_wheel_with_ctrl_zoom_and_the_wheel_alone_does_not(page):
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
