"""The closed form beside what was measured."""

from campaign_manifest import STRAIGHT_20_M
from diff_encoder_sim.analysis.report.closed_form_table import closed_form_table
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_definition import Trial
from paper_datasets import IN, cell, dataset


def test_the_closed_form_is_that_of_a_straight_drive():
    made = dataset(cell('SL', '40', 'odom', [(0.0, 0.3, 1.0), (0.0, -0.3, -1.0)]))
    made = made._replace(
        trials=[one._replace(errors={**one.errors, PoseSource.WORLD: Pose2D(0.0, 0.0, 0.0)}) for one in made.trials],
        requested={'SL': Trial.from_mapping({'test': STRAIGHT_20_M, 'nav': 'embedded'}, '')},
    )
    cells = {row[1]: row[2:] for row in closed_form_table(made).rows}
    # (S d / L) sqrt(1/6) = 321 mm and (d / L) sqrt(1/3) = 1.30 degrees; 0.3 m sqrt(2) = 424 mm.
    assert cells['y [mm]'][0] == '321' and cells['y [mm]'][1].startswith('424 (')
    assert cells['yaw [deg]'][0] == '1.3' and cells['yaw [deg]'][2] == 'as expected'
    assert cells['x [mm]'][2] == 'below'
    assert closed_form_table(dataset(cell('SL', '40', 'odom', [IN]))) is None
