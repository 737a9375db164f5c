import pytest

from diff_encoder_sim.advice.odometry_answer import SENSOR_ERRORS, UNEVEN_LINES
from diff_encoder_sim.advice.trial_study import AS_IT_IS, WITHOUT_ALL, cause_of, switched_off
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from places import ROOT


@pytest.fixture(name='robot')
def robot_fixture():
    config = load_robot_config(ROOT / 'config')
    return lambda **values: override(config, {key.replace('__', '.'): value for key, value in values.items()})


def test_each_cause_that_there_is_is_switched_off_by_itself_and_all_at_once(robot):
    slip, edges = {'simulator__wheel_errors__slip_noise': 1e-6}, {'config__encoder__edge_error': 0.1}
    found = switched_off([robot(**slip, **edges)])
    assert list(found) == [AS_IT_IS, 'without wheel slip', 'without edge errors', WITHOUT_ALL]
    assert found[AS_IT_IS] == {}
    assert found['without wheel slip']['simulator.wheel_errors.slip_noise'] == 0.0
    assert 'config.encoder.edge_error' not in found['without wheel slip']
    assert found[WITHOUT_ALL] == {**found['without wheel slip'], **found['without edge errors']}
    assert cause_of('without edge errors') == 'edge errors'


def test_what_is_switched_off_leaves_an_ideal_robot(robot):
    given = {
        'simulator__wheel_errors__left_slip': 0.01,
        'simulator__wheel_errors__radius_spread': 0.01,
        'simulator__wheel_errors__wheel_separation_error': 0.02,
        'config__encoder__hysteresis': 1.0,
        'config__encoder__faults__max_count_rate': 1000.0,
    }
    without = switched_off([robot(**given)])[WITHOUT_ALL]
    values = {key.replace('__', '.'): value for key, value in given.items()}
    config = load_robot_config(ROOT / 'config')
    assert override(config, {**values, **without}) == override(config, {})


def test_all_errors_of_an_encoder_belong_to_a_cause():
    """What is left says which encoder it is."""
    known = {*SENSOR_ERRORS, *UNEVEN_LINES, 'faults'}
    kinds = {'sensor', 'lines', 'decoding', 'pole_pairs', 'bits', 'side', 'gear_ratio', 'direction'}
    assert set(EncoderModel.model_fields) == known | kinds
