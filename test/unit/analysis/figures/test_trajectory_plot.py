"""Trajectories over the map."""

import pytest

from diff_encoder_sim.analysis.figures import trajectory_plot, variants_of, write_figures
from diff_encoder_sim.analysis.figures.trajectory_plot import draw_trajectories
from figure_panels import driven, requested_trial, shown


def test_trajectories_are_over_the_map_and_few():
    panels = shown(draw_trajectories(variants_of(driven())[0], 'SL', requested_trial('SL')))
    assert [panel.get_title() for panel in panels] == ['SL, 40 PPR', 'SL, 90 PPR']
    true, odometry = (each.get_segments() for each in panels[0].collections)
    assert len(true) == len(odometry) == trajectory_plot.MOST_TRIALS
    assert odometry[0][0] == pytest.approx([-10.0, 0.0]) and odometry[0][-1] == pytest.approx([10.0, 1.0])
    assert len(panels[0].images) == 1
    assert len(panels[0].lines) == 3  # start, goal, and the end of the trial that failed


@pytest.mark.heavy
def test_trajectories_need_tracks(tmp_path):
    dataset = driven()
    assert 'trajectories_SL' in [figure.name for figure in write_figures(dataset, tmp_path / 'with')]
    without = dataset._replace(trials=[trial._replace(tracks=None) for trial in dataset.trials])
    assert 'trajectories_SL' not in [figure.name for figure in write_figures(without, tmp_path / 'without')]
