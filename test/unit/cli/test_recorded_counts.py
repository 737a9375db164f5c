"""Recorded counts of a trial: where they wrap and restart, and what the user is told of them."""

import struct

import numpy as np
import pytest

from diff_encoder_sim.wheels.counter import wrap_count
from reencoding_drives import ROS1, START_NS, angles_rad, write_ros1
from reencoding_runs import contents, run, samples_of
from trial_bags import trial

PPR = 1024

ANGLES_RAD = angles_rad(2001)

ROWS = samples_of(ANGLES_RAD, PPR)

TURNED = (ANGLES_RAD[-1] - ANGLES_RAD[0]) / (2.0 * np.pi)  # left, right


def counted(path, about, counts):
    rows = [('/trial', START_NS, ROS1.text(about.model_dump_json()))]
    pairs = zip(ROWS, counts)
    rows += [('/encoder_pulse', sample[0], ROS1.pulses(sample[0], pair)) for sample, pair in pairs]
    return write_ros1(path, rows)


def wrapped(modulus):
    return [[wrap_count(count, modulus) for count in sample[1:3]] for sample in ROWS]


def about(**changes):
    joints = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}
    return trial(**joints, **{'ppr': PPR, **changes})


def pulses(folder, label):
    """Left and right counts in the bag that was written."""
    messages = contents(next(folder.glob(f'*_{label}.bag')))['/encoder_pulse']
    return [struct.unpack('<qq', raw[-16:]) for raw in messages]


def test_counts_wrap_where_the_bags_trial_says_and_computed_ones_do_not(tmp_path, capsys):
    bag = counted(tmp_path / 'narrow.bag', about(counter_modulus=512), wrapped(512))
    run(bag, '--ppr', '64', '65536', '--out', tmp_path / 'out')
    said = capsys.readouterr()
    assert "counts wrap at 512: the bag's /trial" in said.out and said.err == ''
    for ppr in (64, 65536):
        left, right = np.subtract(pulses(tmp_path / 'out', f'{ppr}ppr')[-1], pulses(tmp_path / 'out', f'{ppr}ppr')[0])
        assert (left, right) == pytest.approx(TURNED * ppr, abs=1 + ppr / PPR)


def test_a_bag_that_was_reencoded_says_where_its_counts_wrap(tmp_path, capsys):
    config = tmp_path / 'config.yaml'
    config.write_text('counter_modulus: 512\n')
    plain = counted(tmp_path / 'plain.bag', about(), wrapped(0))
    run(plain, '--ppr', '1024', '--config', config, '--out', tmp_path / 'narrow')
    run(next((tmp_path / 'narrow').glob('*.bag')), '--ppr', '1024', '--out', tmp_path / 'again')
    said = capsys.readouterr()
    assert f'counts wrap at 512: {config}' in said.out and "counts wrap at 512: the bag's /trial" in said.out
    assert 'restart' not in said.err
    left, right = np.subtract(pulses(tmp_path / 'again', '1024ppr')[-1], pulses(tmp_path / 'again', '1024ppr')[0])
    assert (left, right) == pytest.approx(TURNED * PPR, abs=1)


def test_restarts_are_no_motion_and_told_once(tmp_path, capsys):
    middle = len(ROWS) // 2
    zero = ROWS[middle][1:3]
    counts = [sample[1:3] for sample in ROWS[:middle]]
    counts += [[count - at for count, at in zip(sample[1:3], zero)] for sample in ROWS[middle:]]
    run(counted(tmp_path / 'a.bag', about(), counts), '--ppr', '64', '128', '--out', tmp_path / 'out')
    [line] = capsys.readouterr().err.splitlines()
    assert '/encoder_pulse: counter restarts: 1;' in line
    found = pulses(tmp_path / 'out', '128ppr')
    one_interval = 128 * TURNED / len(ROWS)
    assert np.subtract(found[-1], found[0]) == pytest.approx(128 * TURNED - one_interval, abs=2)


@pytest.mark.parametrize(
    ('changes', 'note'),
    [
        ({'encoder': 'hoverboard_hub'}, 'the angles are counts of 1024 hoverboard_hub, with its errors'),
        ({'variant': 'missed'}, 'the angles are counts of 1024, variant missed, with its errors'),
        ({}, ''),
    ],
)
def test_counts_have_the_errors_of_what_counted_them(tmp_path, capsys, changes, note):
    run(counted(tmp_path / 'a.bag', about(**changes), wrapped(0)), '--ppr', '64')
    err = capsys.readouterr().err
    assert err.strip() == (note and f'reencode: {tmp_path / "a.bag"}: {note}')
