"""The IMUs of config/imu, IMUs by name or path, and what is refused."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.imu import PEAK_ALLAN_DEVIATION, ImuParams, InertialSensorParams, imu_settings, load_imu
from diff_encoder_sim.simulation.simulator import SimulatorParams
from places import ROOT

CONFIG = ROOT / 'config'
NAMES = sorted(path.stem for path in (CONFIG / 'imu').glob('*.yaml'))


@pytest.mark.parametrize('name', NAMES)
def test_each_imu_of_the_catalogue_can_be_simulated(name):
    imu = load_imu(name, CONFIG, ROOT).imu
    SimulatorParams.from_mapping({'imu': imu.model_dump()}, name)
    for sensor in (imu.gyroscope, imu.accelerometer):
        # A sample's noise is a few steps at most, and within the range at rest.
        assert 0.0 < sensor.resolution < 100 * sensor.noise_variance(imu.rate) ** 0.5
        assert sensor.range > 3 * sensor.bias + sensor.resolution
    assert imu.accelerometer.range > 1.5 * 9.81


def test_the_catalogue_has_a_cheap_gyroscope_and_a_tactical_one_in_this_order():
    assert NAMES == ['bmi088', 'bno055', 'mpu6050', 'stim300']
    gyroscopes = {name: load_imu(name, CONFIG, ROOT).imu.gyroscope for name in NAMES}
    by_bias = sorted(NAMES, key=lambda name: gyroscopes[name].bias)
    assert (by_bias[0], by_bias[-1]) == ('stim300', 'mpu6050')
    # In the units of datasheets: deg/sqrt(h), deg/h.
    found = gyroscopes['stim300'].noise_density * 60, gyroscopes['bmi088'].bias_instability * 3600
    assert np.degrees(found) == pytest.approx([0.15, 2.0], rel=1e-3)


def test_settings_have_every_parameter_by_its_dotted_key_and_none_without_a_name(tmp_path):
    settings = imu_settings('bno055', CONFIG, ROOT)
    assert settings['simulator.imu.gyroscope.noise_density'] == 2.443e-4
    assert settings['simulator.imu.accelerometer.bias_instability'] == 0.0  # not in the file
    assert imu_settings('', CONFIG, ROOT) == imu_settings('none', CONFIG, ROOT) == {}
    (tmp_path / 'mine.yaml').write_text((CONFIG / 'imu' / 'bno055.yaml').read_text())
    assert imu_settings('mine.yaml', CONFIG, tmp_path) == settings


def test_an_imu_that_is_not_there_is_refused():
    with pytest.raises(ConfigError, match=r"^imu: given 'bno05'; allowed: bmi088, bno055, mpu6050, stim300, or a"):
        load_imu('bno05', CONFIG, ROOT)


@pytest.mark.parametrize(
    ('given', 'error'),
    [
        ({'rate': 0.0}, 'imu.rate: given 0.0; allowed: 0.1 to 100 [Hz]'),
        ({'rate': 30.0}, "imu: given {'rate': 30.0}; allowed: a rate whose period is whole 10 ms"),
        ({'latency': -0.1}, 'imu.latency: given -0.1; allowed: 0 to 10 [s]'),
        ({'frame': ''}, "imu.frame: given ''; allowed: "),
        ({'gyroscope': {'noise_density': float('nan')}}, 'imu.gyroscope.noise_density: given nan; allowed: 0 to 10000'),
        ({'gyroscope': {'bias_time': 0.0}}, 'imu.gyroscope.bias_time: given 0.0; allowed: 0.001 to 1e6 [s]'),
        ({'accelerometer': {'noise': 1.0}}, 'imu.accelerometer.noise: unknown key'),
        (5, 'imu: given 5; allowed: a mapping'),
    ],
)
def test_a_bad_parameter_is_one_line_with_its_key(given, error):
    with pytest.raises(ConfigError) as raised:
        SimulatorParams.from_mapping({'imu': given}, 'simulator.yaml')
    assert str(raised.value).startswith(f'simulator.yaml: {error}') and '\n' not in str(raised.value)


def test_the_greatest_allan_deviation_of_the_drift_is_the_bias_instability():
    x = np.linspace(1.8, 2.0, 2001)  # of the correlation time
    variance = 2 / x * (1 - (3 - 4 * np.exp(-x) + np.exp(-2 * x)) / (2 * x))
    assert PEAK_ALLAN_DEVIATION == pytest.approx(np.sqrt(variance.max()), abs=1e-5)
    assert InertialSensorParams(bias_instability=2.0).bias_drift == 2.0 / PEAK_ALLAN_DEVIATION


def test_the_variance_of_a_sample_is_that_of_noise_and_quantisation():
    sensor = InertialSensorParams(noise_density=0.02, resolution=0.1)
    assert sensor.noise_variance(100.0) == pytest.approx(0.04 + 0.01 / 12)
    assert ImuParams(rate=50.0, latency=0.0049).period_ns == 20_000_000
