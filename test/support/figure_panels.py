"""What the tests of figures share: datasets that are drawn, and the panels that are seen."""

import numpy as np

from diff_encoder_sim.analysis.dataset import Tracks
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Outcome, Trial
from places import CONFIG
from synthetic_trials import dataset_of, trial_data


def requested_trial(test='SL'):
    return Trial(test=load_test(test, CONFIG), nav='embedded')


def shown(drawing):
    """The panels that can be seen, by row."""
    return [panel for panel in drawing.axes if panel.get_visible()]


def driven():
    """A dataset with two encoders, whose odometry starts right and leaves by a metre in twenty."""
    x_m = np.linspace(-10.0, 10.0, 50)
    tracks = Tracks(*(np.column_stack((x_m, slope * (x_m + 10.0))) for slope in (0.0, 0.05)))
    return dataset_of(
        (
            trial_data('SL', ppr, number, tracks=tracks, outcome=Outcome.SUCCEEDED if number else Outcome.COLLISION)
            for ppr in ('40', '90')
            for number in range(12)
        ),
        requested={'SL': requested_trial()},
    )
