"""The wheels of a robot in the trial that its bag holds."""

from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import OF_ENCODER, OF_ODOMETRY, Trial, wheels_of
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

TEST = TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'drive': [{'straight': 1.0}]}, '')


def test_all_that_odometry_needs_is_kept():
    odometry, encoder = (
        OdometryParams(wheel_diameter=0.07, axle_x=0.1),
        EncoderParams(left_joint='l', left_reversed=True, counter_modulus=4096),
    )
    trial = Trial(test=TEST, **wheels_of(odometry, encoder))
    again = Trial.model_validate_json(trial.model_dump_json())
    assert again == trial
    assert {name: getattr(again, name) for name in OF_ODOMETRY} == {
        'wheel_diameter': 0.07,
        'wheel_separation': 0.4,
        'axle_x': 0.1,
    }
    assert [getattr(again, name) for name in OF_ENCODER] == ['l', 'right_wheel_joint', True, False]
    assert again.counter_modulus == 4096


def test_a_bag_of_a_usual_robot_is_as_before_robots_had_other_axles_and_joints():
    assert Trial(test=TEST).model_dump_json().endswith('"wheel_diameter":0.2,"wheel_separation":0.4}')
