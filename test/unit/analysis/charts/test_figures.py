"""The rows that charts draw, the figures that are written, the same bytes each time, and the charts of a report."""

import base64
import io
import json
import re

import numpy as np
import pytest
from PIL import Image

from diff_encoder_sim.analysis import results_table
from diff_encoder_sim.analysis.charts import chart_page, figures, frames
from diff_encoder_sim.analysis.charts.drawings import LABELS
from diff_encoder_sim.analysis.charts.trial_charts import trial_charts
from diff_encoder_sim.drives.topics import PoseSource
from trial_tables import IN, cell, navigated, results_of, synthetic_results, trial

X_M = np.linspace(-10.0, 10.0, 50)


@pytest.fixture(autouse=True)
def _one_source(monkeypatch):
    """Drawing takes long; test_outputs.py has the figures of all sources."""
    monkeypatch.setattr(figures, 'TOPIC_OF_SOURCE', {PoseSource.WORLD: '/world_pose'})


def driven():
    """Trials of two encoders, whose odometry starts right and leaves by a metre in twenty; the first fails."""
    columns = {'true_path': np.column_stack((X_M, 0.0 * X_M)), 'odom_path': np.column_stack((X_M, 0.05 * (X_M + 10.0)))}
    ends = {1: IN, 2: (0.02, 0.0, 0.5), 3: (7.0, 0.0, 0.0)}
    trials = [trial('SL', ppr, number, world=end, **columns) for ppr in ('40', '90') for number, end in ends.items()]
    trials[0]['outcome'] = 'collision'
    return results_of(trials, requested={'SL': navigated('SL')})


def texts(figure):
    return re.findall(r'>([^<]+)<', figure.svg.read_text(encoding='utf-8'))


def names_of(made, folder):
    return [figure.name for figure in figures.write_figures(made, folder)]


def test_files_of_a_campaign_have_the_same_bytes_each_time(tmp_path):
    drawn, again = (figures.write_figures(driven(), tmp_path / name / 'figures') for name in 'ab')
    expected = ['fig4_xy_errors_world', 'fig5_distributions_world', 'trajectories_SL', 'spread_vs_ppr']
    assert [each.name for each in drawn] == expected
    for figure, other in zip(drawn, again):
        assert figure.caption.endswith('.') and figure.png.parent == figure.svg.parent == tmp_path / 'a' / 'figures'
        assert figure.svg.read_bytes() == other.svg.read_bytes() and figure.png.read_bytes() == other.png.read_bytes()
    with Image.open(drawn[0].png) as image:
        assert image.width > 600
    assert '2 of 3 within, 1 beyond' in texts(drawn[0]) and 'SL: 40 counts' in texts(drawn[2])


@pytest.mark.filterwarnings('error::RuntimeWarning', 'error::UserWarning')
@pytest.mark.parametrize(
    ('made', 'last'),
    [
        (results_of([trial('SL', '90', outcome='aborted')] * 2), ['spread_vs_ppr']),
        (synthetic_results(tests=('SL',), pprs=('ideal', '90-1024'), trials=2), []),
    ],
    ids=['no pose', 'no PPR'],
)
def test_little_data(tmp_path, made, last):
    assert names_of(made, tmp_path) == ['fig4_xy_errors_world', 'fig5_distributions_world', *last]
    assert names_of(results_of([]), tmp_path) == []


def test_of_named_variants_the_first_has_figures_and_other_parameters_have_their_own(tmp_path):
    trials = [
        trial('SL', '40', odom=(0.01 * size, 0.0, 1.0), world=IN, variant=variant, noise=noise)
        for size, variant in enumerate(('none', 'missed 1 %'), 1)
        for noise in ('0.01', '0.03')
    ]
    drawn = figures.write_figures(results_of(trials, varied=['variant', 'noise']), tmp_path)
    names = ('fig4_xy_errors_world', 'fig5_distributions_world')
    assert [each.name for each in drawn] == ['variants', *(f'{name}_variant{one}' for one in '12' for name in names)]
    assert drawn[-1].caption.endswith('(none, noise 0.03).') and {'none', 'missed 1 %'} <= set(texts(drawn[0]))


def test_axes_hold_all_but_far_outliers():
    usual, limit = np.linspace(-1.0, 1.0, 29), figures.shown_limit
    assert limit([usual], least=0.1) == pytest.approx(1.08)
    assert 1.0 < limit([np.append(usual, 80.0)], least=0.1) < 10.0
    assert limit([usual, 5.0 * usual], least=0.1) == pytest.approx(5.4)
    assert limit([np.array([])], least=0.1) == pytest.approx(0.108)


def charts_of(made):
    return trial_charts(made, results_table.first_of_cells(made.trials))


def names(html):
    return re.findall(r'<figure id="chart-(\w+)">', html)


def options(html, legend):
    field = str(html).partition(f'<legend>{legend}</legend>')[2].partition('</fieldset>')[0]
    return re.findall(r'(?:</span>|">| checked>)([^<>]+)</label>', field)


def test_a_report_with_bags_has_valid_charts_in_the_colours_of_the_encoders(monkeypatch):
    monkeypatch.setattr(chart_page, 'VALIDATE', True)
    html = charts_of(driven())
    assert names(html) == ['scatter', 'distributions', 'curve', 'path']
    assert options(html, 'Encoder') == ['40 counts', '90 counts'] and options(html, 'Test') == ['SL']
    assert 'style="color: #7ad151"' in html and 'style="color: #440154"' in html


def test_of_many_trials_the_first_of_each_cell_are_points_and_spreads_are_of_all(monkeypatch):
    monkeypatch.setattr(results_table, 'MOST_SHOWN', 5)
    html = charts_of(results_of(*(cell('SL', ppr, 'world', [IN, (0.02, 0.1, 0.0)] * 10) for ppr in ('40', '90'))))
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    data = json.loads(content)['data'].values()
    assert [rows['encoder'] for rows in data if 'series' in rows and 'x' in rows] == [['40', '40', '90', '90']]
    assert [set(rows['trials']) for rows in data if 'std' in rows and 'trials' in rows] == [{20}]
    assert 'The first 2 trials of each cell, of 40, with median and quartiles' in html
    assert names(html) == ['scatter', 'distributions', 'curve']


def test_charts_without_data_are_left_out():
    html = charts_of(results_of(cell('SL', 'ideal', 'world', [IN] * 2)))
    assert names(html) == ['scatter', 'distributions'] and options(html, 'Pose') == ['/world_pose minus goal']
    assert charts_of(results_of([trial('SL', '40', 1, 'lost')])) is None


OWN, _, TRUE = LABELS[:3]  # the odometry's own error and the true pose
WAVE = np.column_stack((np.linspace(0.0, 10.0, 500), np.sin(np.linspace(0.0, 10.0, 500))))


def of_paths(count, ppr='90'):
    return [trial('SL', ppr, number, true_path=WAVE, odom_path=2.0 * WAVE) for number in range(count)]


def farthest_m(points, line):
    """Distance of the point that is farthest from a line through others."""
    steps = np.diff(line, axis=0)
    squares = np.maximum(np.square(steps).sum(axis=1), 1e-12)
    along = np.clip(((points[:, None] - line[:-1]) * steps).sum(axis=2) / squares, 0.0, 1.0)
    return np.linalg.norm(points[:, None] - line[:-1] - along[..., None] * steps, axis=2).min(axis=1).max()


def test_a_trial_has_a_name_and_an_error_of_each_series_that_it_has_poses_for():
    poses = {'world': (0.01, 0.0, 1.0), 'odom': (0.02, 0.1, 3.0)}
    first = trial('SL', '40', 3, 'timed_out', **poses, seed=2**60 + 1, bag='/b.bag')
    made = results_of([first, trial('SMT', '90', 1, world=IN)])
    rows = frames.error_rows(made.trials)
    assert rows['trial'].tolist() == [0, 0, 0, 1] and rows['setup'].tolist() == ['SL'] * 3 + ['SMT']
    [own] = rows[rows['series'] == OWN].to_dict('records')
    assert (own['x'], own['y'], own['yaw'], own['encoder']) == pytest.approx((0.01, 0.1, 2.0, '40'))
    named = frames.trial_rows(made.trials).iloc[0]
    assert named.tolist() == [0, 3, '1152921504606846977', 'b.bag', 'timed out']


def test_spreads_have_intervals_and_cells_without_a_spread_are_left_out():
    cells = [('40', [IN] * 3), ('90', [IN, (0.03, 0.0, 2.0)]), ('ideal', [IN])]
    rows = frames.spread_rows(results_of(*(cell('SL', ppr, 'world', errors) for ppr, errors in cells)).trials)
    assert set(rows['encoder']) == {'90'} and set(rows['series']) == {TRUE}
    assert rows['quantity'].tolist() == ['x', 'y', 'yaw'] and set(rows['trials']) == {2}
    assert ((0.0 < rows['low']) & (rows['low'] < rows['std']) & (rows['std'] < rows['high'])).all()


def test_the_closed_form_falls_over_the_range_of_the_encoders():
    made = synthetic_results(tests=('SL', 'SMT'), trials=1)._replace(requested={'SL': navigated('SL')})
    rows = frames.closed_form_rows(made)
    rows = rows[rows['quantity'] == 'y']
    assert set(rows['setup']) == {'SL'} and rows['std'].is_monotonic_decreasing
    expected = np.array([[40.0, 0.321], [4096.0, 0.0031]])
    assert rows.iloc[[0, -1]][['ppr', 'std']].values == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize('within', [1e-3, 0.3])
def test_a_simplified_line_keeps_its_shape_and_ends(within):
    line = frames.simplified(WAVE, within)
    assert farthest_m(WAVE, line) <= within
    assert len(line) < 0.25 * len(WAVE) and (line[[0, -1]] == WAVE[[0, -1]]).all()


def test_paths_have_few_points_on_a_floor_with_start_and_goal():
    made = results_of([*of_paths(3), trial('SL', '90', 7), *of_paths(3, '1024')], requested={'SL': navigated('SL')})
    assert frames.with_paths(made.trials, 4).index.tolist() == [0, 1, 4, 5]
    floors = frames.floor_rows(frames.with_paths(made.trials), made)
    x_m, y_m, width_m, height_m = floors.loc['SL']
    left, right, bottom, top = x_m - 0.5 * width_m, x_m + 0.5 * width_m, y_m - 0.5 * height_m, y_m + 0.5 * height_m
    assert left < -10.0 and right > 20.0 and bottom < -2.0 and top > 2.0
    marks = frames.mark_rows(made, ['SL', 'own'])
    assert list(zip(marks['mark'], marks['x'])) == [('start', -10.0), ('goal', 10.0)]
    paths = frames.path_rows(made.trials.head(1), floors).itertuples()
    for row, name, factor in zip(paths, ('true path', '/odom'), (1.0, 2.0)):
        path_m = np.column_stack((row.x, row.y))
        assert row.path == name and path_m[-1] == pytest.approx(factor * WAVE[-1], abs=0.001)
        assert farthest_m(factor * WAVE, path_m) < frames.STRAIGHT_WITHIN * (right - left)


def test_the_map_is_an_image_with_its_walls():
    made = results_of(of_paths(1), requested={'SL': navigated('SL')})
    [row] = frames.map_rows(made, ['SL', 'own']).to_dict('records')
    with Image.open(io.BytesIO(base64.b64decode(row['url'].partition(',')[2]))) as image:
        alpha = np.asarray(image)[:, :, 1]
    assert row['right'] - row['left'] > 30.0 > row['top'] - row['bottom'] > 5.0
    # The hallway's walls are at its sides, and nothing is on its middle line between its ends.
    middle = alpha[alpha.shape[0] // 2]
    assert alpha.any() and not middle[len(middle) // 4 : -len(middle) // 4].any()
