"""Standard deviations against PPR."""

import pytest

from diff_encoder_sim.analysis.figures import variants_of
from diff_encoder_sim.analysis.figures.spread import draw_spread
from figure_panels import requested_trial, shown
from synthetic_trials import ALTO, synthetic_dataset


def test_real_encoders_are_points_beside_the_line_of_ideal_ones_whatever_their_counts():
    labels = ('40', '1024', '1024 posital_inh', '1024 other', '1632.67 pololu_25d', '8192 amt102')
    dataset = synthetic_dataset(tests=('SL',), pprs=labels, trials=5)
    panels = shown(draw_spread(variants_of(dataset)[0], ALTO, {'SL': requested_trial('SL')}))
    lines = [container[0] for container in panels[1].containers]
    ideal = [line for line in lines if line.get_linestyle() == '-']
    real = [line for line in lines if line.get_linestyle() == 'None']
    assert {len(line.get_xdata()) for line in ideal} == {2} and {len(line.get_xdata()) for line in real} == {4}
    assert len(ideal) + len(real) == len(lines)


def test_spread_has_a_line_for_each_source_and_the_closed_form():
    dataset = synthetic_dataset(tests=('SL',), trials=5)
    panels = shown(draw_spread(variants_of(dataset)[0], ALTO, {'SL': requested_trial('SL')}))
    labels = panels[1].get_legend_handles_labels()[1]
    assert len(panels) == 3 and len(labels) == 6
    closed_form = next(line for line in panels[1].lines if line.get_label().startswith('quantisation alone'))
    assert closed_form.get_ydata() == pytest.approx([0.321, 0.142, 0.0125, 0.0031], rel=0.02)
