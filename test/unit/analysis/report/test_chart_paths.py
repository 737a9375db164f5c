"""The paths of the report's chart: few points, in few characters, and no other shape."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from diff_encoder_sim.analysis.dataset import Tracks
from diff_encoder_sim.analysis.report import chart_paths
from diff_encoder_sim.analysis.report.chart_paths import (
    STRAIGHT_WITHIN,
    floors_of,
    map_rows,
    mark_rows,
    path_indices,
    path_rows,
    simplified,
)
from figure_panels import requested_trial
from synthetic_trials import dataset_of, trial_data

WAVE = np.column_stack((np.linspace(0.0, 10.0, 500), np.sin(np.linspace(0.0, 10.0, 500))))


def farthest_m(points, line):
    """Distance of the point that is farthest from a line through others."""
    steps = np.diff(line, axis=0)
    squares = np.maximum(np.square(steps).sum(axis=1), 1e-12)
    along = np.clip(((points[:, None] - line[:-1]) * steps).sum(axis=2) / squares, 0.0, 1.0)
    return np.linalg.norm(points[:, None] - line[:-1] - along[..., None] * steps, axis=2).min(axis=1).max()


def with_tracks(count=3, ppr='90', **other):
    return [trial_data('SL', ppr, number, tracks=Tracks(WAVE, 2.0 * WAVE), **other) for number in range(count)]


@pytest.mark.parametrize('within', [1e-3, 1e-2, 0.3])
def test_a_simplified_line_keeps_its_shape_and_ends(within):
    line = simplified(WAVE, within)
    assert farthest_m(WAVE, line) <= within
    assert len(line) < 0.25 * len(WAVE) and (line[[0, -1]] == WAVE[[0, -1]]).all()


def test_paths_are_increments_in_millimetres_that_end_where_the_track_does():
    dataset = dataset_of(with_tracks(1))
    floors = floors_of(dataset, [0])
    true, odom = path_rows(dataset, [0], floors)
    assert (true['path'], odom['path']) == ('true path', '/odom') and true['encoder'] == '90'
    for row, factor in ((true, 1.0), (odom, 2.0)):
        path_m = np.cumsum(np.column_stack((row['dx'], row['dy'])), axis=0) / 1000.0
        assert farthest_m(factor * WAVE, path_m) < STRAIGHT_WITHIN * 25.0
        assert path_m[-1] == pytest.approx(factor * WAVE[-1], abs=0.001)


def test_the_floor_has_all_paths_start_and_goal_on_it():
    dataset = dataset_of(with_tracks(), requested={'SL': requested_trial()})
    floor = floors_of(dataset, [0, 1])['SL']
    assert floor['left'] < -10.0 and floor['right'] > 20.0 and floor['bottom'] < -2.0 and floor['top'] > 2.0
    assert [(row['mark'], row['x']) for row in mark_rows(dataset, ['SL', 'own'])] == [('start', -10.0), ('goal', 10.0)]


def test_of_many_trials_the_first_of_each_cell_have_paths(monkeypatch):
    monkeypatch.setattr(chart_paths, 'MOST_TRIALS', 4)
    without = trial_data('SL', '90', 7)
    dataset = dataset_of([without, *with_tracks(3), *with_tracks(3, ppr='1024')])
    assert path_indices(dataset) == [1, 2, 4, 5]


def test_the_map_is_an_image_where_its_walls_are():
    [row] = map_rows(dataset_of(with_tracks(1), requested={'SL': requested_trial()}), ['SL', 'own'])
    with Image.open(io.BytesIO(base64.b64decode(row['url'].partition(',')[2]))) as image:
        alpha = np.asarray(image)[:, :, 1]
    assert row['right'] - row['left'] > 30.0 > row['top'] - row['bottom'] > 5.0
    # The hallway's walls are at its sides, and nothing is on its middle line between its ends.
    middle = alpha[alpha.shape[0] // 2]
    assert alpha.any() and not middle[len(middle) // 4 : -len(middle) // 4].any()
