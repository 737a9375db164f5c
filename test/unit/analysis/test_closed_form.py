"""The closed form of the quantisation error, and what it is compared with."""

import math

import pytest

from diff_encoder_sim.analysis.closed_form import closed_form_std, odometry_minus_truth
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.test_definition import PoseParams
from figure_panels import requested_trial
from synthetic_trials import ALTO, trial_data


def test_odometry_minus_truth_goes_round_at_half_a_turn():
    trials = [
        trial_data(errors={PoseSource.ODOM: (0.3, 0.0, 3.1), PoseSource.WORLD: (0.1, 0.0, -3.1)}),
        trial_data(errors={PoseSource.ODOM: (0.3, 0.0, 3.1), PoseSource.WORLD: None}),
    ]
    assert odometry_minus_truth(trials, X) == pytest.approx([0.2])
    assert odometry_minus_truth(trials, YAW) == pytest.approx([math.degrees(6.2 - 2.0 * math.pi)])


@pytest.mark.parametrize(('ppr', 'lateral_m'), [(40, 0.321), (90, 0.142), (1024, 0.0125), (4096, 0.0031)])
def test_closed_form_of_the_straight_line(ppr, lateral_m):
    m_per_pulse = math.pi * 0.2 / ppr
    _, y_m, yaw_rad = closed_form_std(requested_trial('SL'), ALTO, ppr)
    assert y_m == pytest.approx(lateral_m, rel=0.015)
    assert yaw_rad == pytest.approx(m_per_pulse / 0.4 * math.sqrt(1.0 / 3.0))


def test_closed_form_is_along_the_maps_axes():
    requested = requested_trial('SL')
    turned = requested.model_copy(
        update={
            'test': requested.test.model_copy(
                update={
                    'start': PoseParams(yaw=math.pi / 2),
                    'route': [
                        requested.test.route[-1].model_copy(update={'goal': PoseParams(y=20.0, yaw=math.pi / 2)})
                    ],
                }
            )
        }
    )
    along_x, along_y = closed_form_std(requested, ALTO, 40), closed_form_std(turned, ALTO, 40)
    assert along_y == pytest.approx(along_x[[1, 0, 2]])
