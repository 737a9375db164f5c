"""The figure of a campaign's variants."""

from diff_encoder_sim.analysis.figures.variant_plot import draw_variants
from diff_encoder_sim.drives.trial_definition import Outcome
from figure_panels import shown
from paper_datasets import dataset, trial

NAMES = ('none', 'missed 1 %', 'restart')


def cells(test, ppr, other=()):
    return [
        trial(
            test, ppr, 1, Outcome.LOST if name == 'restart' else Outcome.SUCCEEDED, varied, odom=odom, world=(0, 0, 0)
        )
        for name, odom in zip(NAMES, ((0.01, 0.0, 0.1), (0.2, 0.0, 2.0), (3.0, 4.0, 5.0)))
        for varied in [(*other, ('variant', name))]
    ]


def test_a_row_for_each_test_has_all_variants_by_encoder():
    panels = shown(draw_variants(dataset(cells('SL', '40'), cells('SL', '8192 amt102'), cells('DLD', '40'))))
    assert [panel.get_title() for panel in panels] == [
        f'{test}: {error}' for test in ('SL', 'DLD') for error in ('position [mm]', 'heading [deg]')
    ]
    assert [label.get_text() for label in panels[0].get_yticklabels()] == list(NAMES)
    assert [len(panel.containers) for panel in panels] == [6, 6, 3, 3]


def test_trials_that_failed_are_hollow():
    position = shown(draw_variants(dataset(cells('SL', '40'))))[0]
    points = [container[0] for container in position.containers]
    assert [float(point.get_xdata()[0]) for point in points] == [10.0, 200.0, 5000.0]
    assert [isinstance(point.get_markerfacecolor(), str) for point in points] == [False, False, True]
