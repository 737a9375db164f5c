"""The closed form beside what was measured."""

import math

import pytest

from campaign_manifest import STRAIGHT_20_M
from diff_encoder_sim.analysis.closed_form import closed_form_table
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Trial
from figure_panels import requested_trial
from paper_datasets import IN, cell, dataset, trial


def test_the_closed_form_is_that_of_a_straight_drive():
    made = dataset(cell('SL', '40', 'odom', [(0.0, 0.3, 1.0), (0.0, -0.3, -1.0)]))
    made = made._replace(
        trials=[one._replace(errors={**one.errors, PoseSource.WORLD: Pose2D(0.0, 0.0, 0.0)}) for one in made.trials],
        requested={'SL': Trial.from_mapping({'test': STRAIGHT_20_M, 'nav': 'embedded'}, '')},
    )
    cells = {row[1]: row[2:] for row in closed_form_table(made).rows}
    # (S d / L) sqrt(1/6) = 321 mm; 0.3 m sqrt(2) = 424 mm.
    assert cells['y [mm]'][:2] == ['–', '321'] and cells['y [mm]'][2].startswith('424 (')
    # 20 m are 1273.24 pulses: 2.25 degrees sqrt(2 0.24 0.76), and all trials stopped just there.
    assert cells['yaw [deg]'][:2] == ['1.36', '1.36'] and cells['yaw [deg]'][3] == 'as expected'
    assert cells['x [mm]'][3] == 'below'
    assert closed_form_table(dataset(cell('SL', '40', 'odom', [IN]))) is None


def test_the_heading_is_that_of_where_the_trials_stopped():
    stops_m = [-1.0, -0.5]  # 19 m are 1209.58 pulses, 19.5 m are 1241.41
    made = dataset(
        trial('SL', '40', number, odom=(x_m, 0.0, 0.0), world=(x_m, 0.0, 0.0)) for number, x_m in enumerate(stops_m)
    )
    made = made._replace(requested={'SL': Trial.from_mapping({'test': STRAIGHT_20_M, 'nav': 'embedded'}, '')})
    [row] = [row for row in closed_form_table(made).rows if row[1] == 'yaw [deg]']
    expected_deg = 2.25 * math.sqrt(0.5775 * 0.4225 + 0.4084 * 0.5916)  # 2 f (1 - f), and the mean of both
    assert row[2] == '1.36' and float(row[3]) == pytest.approx(expected_deg, abs=0.005)


def test_other_drives_have_the_average_alone():
    made = dataset(cell('DLD', '40', 'odom', [IN, IN]))
    made = made._replace(
        trials=[one._replace(errors={**one.errors, PoseSource.WORLD: Pose2D(0.0, 0.0, 0.0)}) for one in made.trials],
        requested={'DLD': requested_trial('DLD')},
    )
    [row] = [row for row in closed_form_table(made).rows if row[1] == 'yaw [deg]']
    assert row[2:4] == ['–', '1.3']
