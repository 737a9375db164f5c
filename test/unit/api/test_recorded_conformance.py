"""The command conformance on bags of right and wrong nodes, whose drives and time stamps are random."""

import math
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.api.conformance import judge_drive
from diff_encoder_sim.api.options import ConformanceOptions
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli import conformance
from diff_encoder_sim.conformance.mapping import Settings, Wheels
from diff_encoder_sim.conformance.verdicts import FAIL
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_files import OPENERS, SUFFIXES
from diff_encoder_sim.drives.message_encoders import encode_encoder_pulse
from diff_encoder_sim.drives.topics import RecordedTopic
from diff_encoder_sim.wheels.report_link import EncoderSample
from odometry_subjects import COUNTS, SimpleOdometry, mapping_of

TYPES = {'/encoder_pulse': topics.ENCODER_PULSE_TYPE, '/odom': topics.ODOMETRY_TYPE, '/tf': topics.TRANSFORMS_TYPE}
WHEELS, JOINTS, PERIOD_NS = Wheels(), ('left_wheel_joint', 'right_wheel_joint'), 50_000_000
FAULTS = {
    'diameter as radius': '2.2',
    'left and right swapped': '2.3',
    'degrees as radians': '2.4',
    'Euler integration': '2.5',
    'twist in odom': '5.1',
    'unsigned twist': '5.2',
    'transform twice': '6.3',
    'transform inverted': '6.4',
    'leading slash': '6.5',
    'quaternion not normalised': '6.6',
    'covariance zero': '8.1',
    'covariance constant': '8.2',
}


def recorded(folder, fault='', seed=0, bag_format='ros1', late_ns=0):
    """A bag of a drive of a minute: straight, arcs, turns in place, in reverse, and stops."""
    random = np.random.default_rng(seed)
    speeds = [(0.5, 0.0), (-0.3, 0.0), (0.0, 0.2), (0.4, 1.5), (0.0, 0.0), (0.4, -1.5), (-0.4, 0.8)]
    speeds += random.uniform((-0.5, -1.5), (0.5, 1.5), (5, 2)).tolist()
    node = SimpleOdometry(mapping_of(COUNTS), WHEELS, fault)
    node.start(Settings(0, 1e-6))
    path = folder / f'drive{SUFFIXES[bag_format]}'
    file = OPENERS[bag_format](path)
    publishers = {
        name: file.add_publisher(RecordedTopic(name, kind, ('/node',)), '/node') for name, kind in TYPES.items()
    }
    travel_m, stamp_ns = random.uniform(0.0, 1.0, 2), 1_700_000_000_000_000_000
    for linear, angular in speeds:
        for _ in range(100):
            travel_m = travel_m + 0.05 * (linear + 0.2 * angular * np.array([-1.0, 1.0]))
            counts = np.floor(travel_m / WHEELS.m_per_count).astype(int)
            stamp_ns += PERIOD_NS
            node.odometry, node.transforms = [], []
            node.send(SimpleNamespace(stamp_ns=stamp_ns + late_ns, counts=counts))
            pulse = encode_encoder_pulse(EncoderSample(stamp_ns, *counts.tolist()), JOINTS)
            messages = [('/encoder_pulse', pulse), *(('/tf', each.content) for each in node.transforms)]
            messages += [('/odom', each.content) for each in node.odometry]
            records = [file.prepare(publishers[topic], stamp_ns + 1_000_000, content) for topic, content in messages]
            file.write_prepared(records)
    file.close()
    return path


def judged(path, **changes):
    wheels = {'wheel_diameter': 0.2, 'wheel_separation': 0.4, 'pulses': '/encoder_pulse', 'pulses_ppr': '1024'}
    done = judge_drive(ConformanceOptions(bag=path, **{**wheels, **changes}))
    return {each.clause.number: each for each in done.verdicts}, done


def failed(verdicts):
    return {number: (each.value, each.allowed) for number, each in verdicts.items() if each.outcome == FAIL}


@pytest.mark.parametrize('bag_format', ['ros1', 'mcap'])
def test_right_odometry_passes_whatever_its_drive_and_its_stamps(bag_format, tmp_path):
    for seed in range(10):
        # Odometry has the stamps of the samples, or stamps between them.
        late_ns = seed % 2 * 20_000_000
        verdicts, _ = judged(recorded(tmp_path, '', seed, bag_format, late_ns))
        assert failed(verdicts) == {}, seed
        assert [number for number, each in verdicts.items() if each.outcome == 'pass' and number[0] in '25'] == [
            *('2.2', '2.3', '2.4', '2.5', '5.1', '5.2', '5.3')
        ]
        for path in tmp_path.iterdir():
            path.unlink()


@pytest.mark.parametrize('fault', FAULTS)
def test_a_wrong_node_fails_its_clause(fault, tmp_path):
    verdicts, _ = judged(recorded(tmp_path, fault))
    assert [*failed(verdicts)] == [FAULTS[fault]], failed(verdicts)


def test_a_wrong_geometry_is_found(tmp_path):
    path = recorded(tmp_path)
    assert [*failed(judged(path, wheel_diameter=0.206)[0])] == ['2.2']
    assert [*failed(judged(path, wheel_separation=0.41)[0])] == ['2.4']
    assert math.isclose(float(judged(path, wheel_diameter=0.206)[0]['2.2'].value.split()[0]), 0.2 / 0.206, abs_tol=2e-3)


def test_ticks_and_files_of_the_command(tmp_path, capsys):
    path, out = recorded(tmp_path, 'unsigned twist'), tmp_path / 'out'
    ticks = ['--ticks', '/encoder_pulse.pulses[0]', '/encoder_pulse.pulses[1]', '--ticks-per-revolution', '1024']
    with pytest.raises(SystemExit) as ended:
        conformance.main([str(path), *ticks, '--wheel-diameter', '0.2', '--wheel-separation', '0.4', '--out', str(out)])
    assert ended.value.code == 1
    assert '1 fail' in capsys.readouterr().out
    suite = ElementTree.parse(str(out / 'conformance.xml')).getroot()
    assert suite.get('failures') == '1' and (out / 'conformance.html').stat().st_size > 10_000


def test_mistakes_have_one_line(tmp_path):
    path = recorded(tmp_path)
    for changes, key in (({'odom': '/odometry'}, '--odom'), ({'wheel_diameter': None}, '--wheel-diameter')):
        with pytest.raises(ConfigError) as error:
            judged(path, **changes)
        assert key in str(error.value) and '\n' not in str(error.value)
