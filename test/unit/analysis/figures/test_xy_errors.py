"""Figure 4."""

import matplotlib
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from diff_encoder_sim.analysis.figures import variants_of
from diff_encoder_sim.analysis.figures.style import STYLE
from diff_encoder_sim.analysis.figures.xy_errors import draw_xy_errors
from diff_encoder_sim.drives.topics import PoseSource
from figure_panels import shown
from synthetic_trials import dataset_of, synthetic_dataset, trial_data


def test_xy_errors_count_what_is_inside_and_what_is_beyond():
    errors = [(0.04, 0.04, 0.0), *[(0.01, 0.0, 0.0)] * 8, (7.0, 0.0, 0.0)]
    dataset = dataset_of(trial_data(number=number, errors=error) for number, error in enumerate(errors))
    (panel,) = shown(draw_xy_errors(variants_of(dataset)[0], PoseSource.ODOM))
    assert panel.get_title() == '90 PPR\n8 of 10 inside, 1 beyond'
    assert panel.get_ylabel().startswith('SL')


def test_a_row_of_xy_errors_has_one_scale():
    panels = shown(draw_xy_errors(variants_of(synthetic_dataset(trials=10))[0], PoseSource.ODOM))
    limits = [panel.get_xlim() for panel in panels]
    assert len(panels) == 12
    assert all(len(set(limits[row : row + 4])) == 1 for row in (0, 4, 8)) and len(set(limits)) > 1


@pytest.mark.heavy
@pytest.mark.parametrize(('encoders', 'largest_m'), [(4, 0.047), (5, 35.0)])
def test_labels_below_neighbouring_panels_do_not_collide(encoders, largest_m):
    errors = [(largest_m, -largest_m, 0.0), (-0.9 * largest_m, 0.8 * largest_m, 0.0)]
    dataset = dataset_of(
        trial_data(ppr=str(40 + ppr), number=number, errors=error)
        for ppr in range(encoders)
        for number, error in enumerate(errors)
    )
    with matplotlib.rc_context(STYLE):
        drawing = draw_xy_errors(variants_of(dataset)[0], PoseSource.ODOM)
        FigureCanvasAgg(drawing).draw()
        labels = [label for panel in shown(drawing) for label in _labels_below(panel)]
        boxes = sorted((label.get_window_extent() for label in labels), key=lambda box: box.x0)
    assert len(boxes) >= 2 * encoders
    apart_px = 0.05 * drawing.dpi  # a space
    assert all(left.x1 + apart_px < right.x0 for left, right in zip(boxes, boxes[1:]))


def _labels_below(panel):
    low, high = panel.get_xlim()
    return [label for label in panel.get_xticklabels() if low <= label.get_position()[0] <= high]
