"""The rows that charts draw; paths of few points, in few characters, and no other shape."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from diff_encoder_sim.analysis.charts import frames
from diff_encoder_sim.analysis.charts.drawings import LABELS
from trial_tables import IN, cell, navigated, results_of, synthetic_results, trial

OWN, _, TRUE = LABELS[:3]  # the odometry's own error and the true pose
WAVE = np.column_stack((np.linspace(0.0, 10.0, 500), np.sin(np.linspace(0.0, 10.0, 500))))


def with_paths(count, ppr='90'):
    return [trial('SL', ppr, number, true_path=WAVE, odom_path=2.0 * WAVE) for number in range(count)]


def farthest_m(points, line):
    """Distance of the point that is farthest from a line through others."""
    steps = np.diff(line, axis=0)
    squares = np.maximum(np.square(steps).sum(axis=1), 1e-12)
    along = np.clip(((points[:, None] - line[:-1]) * steps).sum(axis=2) / squares, 0.0, 1.0)
    return np.linalg.norm(points[:, None] - line[:-1] - along[..., None] * steps, axis=2).min(axis=1).max()


def test_a_trial_has_a_name_and_an_error_of_each_series_that_it_has_poses_for():
    first = trial(
        'SL', '40', 3, 'timed_out', world=(0.01, 0.0, 1.0), odom=(0.02, 0.1, 3.0), seed=2**60 + 1, bag='/b.bag'
    )
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
    made = results_of([*with_paths(3), trial('SL', '90', 7), *with_paths(3, '1024')], requested={'SL': navigated('SL')})
    assert frames.with_paths(made.trials, 4).index.tolist() == [0, 1, 4, 5]
    floors = frames.floor_rows(frames.with_paths(made.trials), made)
    left, bottom, right, top = floors.loc['SL']
    assert left < -10.0 and right > 20.0 and bottom < -2.0 and top > 2.0
    marks = frames.mark_rows(made, ['SL', 'own'])
    assert list(zip(marks['mark'], marks['x'])) == [('start', -10.0), ('goal', 10.0)]
    for row, name, factor in zip(
        frames.path_rows(made.trials.head(1), floors).itertuples(), ('true path', '/odom'), (1.0, 2.0)
    ):
        path_m = np.column_stack((row.x, row.y))
        assert row.path == name and path_m[-1] == pytest.approx(factor * WAVE[-1], abs=0.001)
        assert farthest_m(factor * WAVE, path_m) < frames.STRAIGHT_WITHIN * (right - left)


def test_the_map_is_an_image_with_its_walls():
    made = results_of(with_paths(1), requested={'SL': navigated('SL')})
    [row] = frames.map_rows(made, ['SL', 'own']).to_dict('records')
    with Image.open(io.BytesIO(base64.b64decode(row['url'].partition(',')[2]))) as image:
        alpha = np.asarray(image)[:, :, 1]
    assert row['right'] - row['left'] > 30.0 > row['top'] - row['bottom'] > 5.0
    # The hallway's walls are at its sides, and nothing is on its middle line between its ends.
    middle = alpha[alpha.shape[0] // 2]
    assert alpha.any() and not middle[len(middle) // 4 : -len(middle) // 4].any()
