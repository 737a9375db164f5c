"""Recorded drives through encoders that need more than angles, or report more than counts."""

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader

from places import ROOT
from reencoding_drives import JOINTS, MAKERS, START_NS, TICK_NS, angles_rad, drive, write_ros1, write_ros2
from reencoding_runs import run

SPEED_RADPS = 4.0


def config(folder, **changes):
    path = folder / 'config.yaml'
    usual = yaml.safe_load((ROOT / 'config' / 'config.yaml').read_text())
    path.write_text(yaml.safe_dump({**usual, **changes}))
    return path


def there_and_back(maker, is_commanded=True):
    """A straight drive forward for 2 s, then backward, with a command before each."""
    rows = []
    for tick in range(401):
        now_ns = START_NS + tick * TICK_NS
        if is_commanded and tick in (0, 200):
            rows.append(('/cmd_vel', now_ns, maker.command(0.4 if tick == 0 else -0.4, 0.0)))
        angle_rad = 0.1 + 0.01 * SPEED_RADPS * (200 - abs(200 - tick))
        rows.append(('/joint_states', now_ns, maker.joint_state(now_ns, (angle_rad, angle_rad))))
    return rows


def messages(path, topic):
    with AnyReader([path]) as reader:
        return [reader.deserialize(raw, each.msgtype) for each, _, raw in reader.messages() if each.topic == topic]


@MAKERS
@pytest.mark.parametrize('is_commanded', [True, False])
def test_a_single_channel_counts_by_the_recorded_commands(tmp_path, capsys, maker, is_commanded):
    write = write_ros2 if maker.is_ros2 else write_ros1
    bag = write(tmp_path / 'drive.bag', there_and_back(maker, is_commanded))
    given = config(tmp_path, encoder={'sensor': 'single_channel', 'decoding': 'x2'})
    run(bag, '--ppr', '90', '--config', given, '--out', tmp_path / 'out')
    (path,) = (tmp_path / 'out').glob('*.bag')
    pulses = [message.pulses.tolist() for message in messages(path, '/encoder_pulse')]
    note = capsys.readouterr().err
    turned = SPEED_RADPS * 2.0 * 90 / (2 * np.pi)
    if is_commanded:
        assert pulses[-1] == pytest.approx([1, 1], abs=3) and '/cmd_vel' not in note
    else:
        assert pulses[-1] == pytest.approx([2 * turned] * 2, abs=4)
        assert note.count('/cmd_vel') == 1 and 'all counts are forward' in note
    assert max(left for left, _ in pulses) >= turned - 1


def test_commands_do_not_matter_to_encoders_with_two_channels(tmp_path, capsys):
    bag = write_ros1(tmp_path / 'drive.bag', drive())
    run(bag, '--ppr', '90')
    assert '/cmd_vel' not in capsys.readouterr().err


def test_measured_speeds_are_written_and_not_taken_for_angles(tmp_path):
    bag = write_ros1(tmp_path / 'drive.bag', drive())
    given = config(tmp_path, velocity_method='T')
    run(bag, '--ppr', '90', '--config', given, '--out', tmp_path / 'out')
    (path,) = (tmp_path / 'out').glob('*.bag')
    speeds, pulses = messages(path, '/encoder_velocity'), messages(path, '/encoder_pulse')
    assert [message.header.stamp for message in speeds] == [message.header.stamp for message in pulses]
    assert speeds[-1].name == list(JOINTS) and len(speeds[-1].position) == 0
    turned_radps = (angles_rad(501)[-1] - angles_rad(501)[0]) / 5.0
    assert speeds[-1].velocity == pytest.approx(turned_radps, rel=1e-3)
    twist = messages(path, '/odom')[-1].twist.twist
    assert twist.linear.x == pytest.approx(0.1 * turned_radps.mean(), rel=1e-3)
    run(path, '--pulses-ppr', '90', '--ppr', '40')  # finds the counts


def test_with_m_there_is_no_topic_of_speeds(tmp_path):
    run(write_ros1(tmp_path / 'drive.bag', drive()), '--ppr', '90', '--out', tmp_path / 'out')
    (path,) = (tmp_path / 'out').glob('*.bag')
    assert messages(path, '/encoder_velocity') == []
