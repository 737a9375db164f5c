"""What a server of dynamic_reconfigure tells its clients about parameters."""

import ast

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')
pytest.importorskip('dynamic_reconfigure')

from dynamic_reconfigure.encoding import decode_description, encode_description

from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.ros.adjustable import adjustables_of
from diff_encoder_sim.ros.amcl_reconfiguration import LIMITS
from diff_encoder_sim.ros.reconfigure_server import _description


def test_a_client_decodes_types_limits_meanings_and_choices():
    told = decode_description(encode_description(_description(adjustables_of(AmclParams(), LIMITS))))
    by_name = {one['name']: one for one in told['parameters']}
    assert list(by_name) == list(LIMITS)
    particles, model, error = (by_name[name] for name in ('max_particles', 'laser_model_type', 'kld_err'))
    assert [particles[key] for key in ('type', 'min', 'default', 'max')] == ['int', 1, 5000, 10000]
    assert [error[key] for key in ('type', 'min', 'default', 'max')] == ['double', 0.0, 0.01, 1.0]
    assert (particles['description'], particles['edit_method']) == ('most particles', '')
    choices = ast.literal_eval(model['edit_method'])['enum']  # as rqt_reconfigure reads it
    assert [choice['value'] for choice in choices] == ['beam', 'likelihood_field', 'likelihood_field_prob']
