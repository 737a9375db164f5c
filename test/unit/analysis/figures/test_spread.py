"""Standard deviations against PPR."""

import pytest

from diff_encoder_sim.analysis.figures import variants_of
from diff_encoder_sim.analysis.figures.spread import draw_spread
from figure_panels import requested_trial, shown
from synthetic_trials import ALTO, synthetic_dataset


def test_spread_has_a_line_for_each_source_and_the_closed_form():
    dataset = synthetic_dataset(tests=('SL',), trials=5)
    panels = shown(draw_spread(variants_of(dataset)[0], ALTO, {'SL': requested_trial('SL')}))
    labels = panels[1].get_legend_handles_labels()[1]
    assert len(panels) == 3 and len(labels) == 6
    closed_form = next(line for line in panels[1].lines if line.get_label().startswith('quantisation alone'))
    assert closed_form.get_ydata() == pytest.approx([0.321, 0.142, 0.0125, 0.0031], rel=0.02)
