"""The chain of encoder, report link and odometry: a whole drive is what its samples are one by one."""

import numpy as np
import pytest

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from encoder_drives import TICK_NS

DRAWS, SAMPLES = 3, 1200

MOTOR = {'side': 'motor', 'gear_ratio': 10.0}
SENSORS = {
    'ideal': {},
    'edges': {'edge_error': 0.2},
    'edges of x1': {'edge_error': 0.3, 'decoding': 'x1', 'duty_cycle': 0.4},
    'eccentricity': {'eccentricity': 0.05},
    'pattern of x2': {'decoding': 'x2', 'duty_cycle': 0.4},
    'pattern of x4': {'phase_error': 20.0, 'edge_error': 0.1},
    'hysteresis': {'hysteresis': 3.0},
    'backlash': {**MOTOR, 'backlash': 0.1},
    'hall': {'sensor': 'hall', 'sensor_error': 8.0},
    'absolute': {'sensor': 'absolute', 'first_harmonic': 1.0, 'second_harmonic': 0.5, 'hysteresis': 2.0, 'noise': 2.0},
    'single channel': {'sensor': 'single_channel', 'decoding': 'x2', 'duty_cycle': 0.4},
    'by command': {'direction': 'command'},
}
FAULTS = {
    'missed': {'missed': 0.1},
    'missed in bursts': {'missed': 0.1, 'missed_burst': 7.0},
    'extra': {'extra': 0.1, 'extra_burst': 3.0},
    'count rate': {'max_count_rate': 90.0},
    'dead channel': {'dead_channel': 'A', 'dead_from': 0.505, 'dead_for': 0.2, 'dead_every': 1.0},
    'restart': {'restart_at': 4.5},
    'swapped': {'wiring': 'swapped'},
    'inverted, left': {'wiring': 'inverted', 'wheel': 'left'},
    'all': {'missed': 0.05, 'extra': 0.02, 'max_count_rate': 200.0, 'dead_channel': 'B', 'dead_from': 5.0},
}
REPORTS = {
    'jitter': {'jitter': 0.02},
    'late': {'latency': 0.03, 'latency_spread': 0.04},
    'lost': {'lost': 0.2, 'repeated': 0.2, 'reordered': 0.2},
    'of arrival': {'jitter': 0.003, 'latency_spread': 0.1, 'lost': 0.1, 'stamps': 'arrival'},
}
CASES = {
    **{name: {'encoder': encoder} for name, encoder in SENSORS.items()},
    **{name: {'encoder': {'faults': faults}} for name, faults in FAULTS.items()},
    **{name: {'report': report} for name, report in REPORTS.items()},
    'everything': {
        'encoder': {**MOTOR, 'lines': 12, 'edge_error': 0.1, 'faults': FAULTS['all']},
        'report': REPORTS['of arrival'],
    },
    '8 bits': {'counter_modulus': 256, 'encoder': {'faults': FAULTS['restart']}, 'report': REPORTS['lost']},
    'fast reports': {'rate': 73.0},
    'behind the axle': {'axle_x': 0.3},
    'unequal wheels': {'wheel_diameter': {'left': 0.198, 'right': 0.202}},
}


def drive_of(seed=1):
    """Wheels that turn unevenly, stop and turn back, each at its own speeds; and commands of their directions."""
    rng = np.random.default_rng(seed)
    speeds = np.repeat(rng.normal(0.0, 5.0, (12, 2)), SAMPLES // 12, axis=0)
    speeds[SAMPLES // 2 : SAMPLES // 2 + 100] = 0.0
    angles_rad = np.cumsum(0.01 * speeds, axis=0) + rng.normal(0.0, 1e-3, (SAMPLES, 2))
    commands = np.where(rng.random((SAMPLES, 1)) < 0.1, speeds, 0.0)
    return Drive(12_345 + TICK_NS * np.arange(SAMPLES), angles_rad), commands


def chain_of(case, method, draws=1):
    both = {'ppr': 120, **{key: value for key, value in case.items() if key in ('encoder', 'counter_modulus')}}
    params = {**both, 'velocity_method': method, 'seed': 7, **case}
    of_odometry = {key: value for key, value in case.items() if key in ('axle_x', 'wheel_diameter')}
    of_encoder = {key: value for key, value in params.items() if key not in of_odometry}
    odometry = OdometryParams.from_mapping({**both, 'velocity_method': method, **of_odometry}, '')
    return Chain(EncoderParams.from_mapping(of_encoder, ''), odometry, draws)


def stepped(chain, drive, commands):
    """Each report with the row of the drive at which it arrives."""
    for row, (stamp_ns, angles_rad) in enumerate(zip(drive.stamps_ns.tolist(), drive.wheel_angles_rad.tolist())):
        chain.encoders.take_command(*commands[row].tolist())
        for report in chain.step(stamp_ns, *angles_rad):
            yield (row, *report)


@pytest.mark.parametrize('method', ['M', 'T', 'MT'])
@pytest.mark.parametrize('name', CASES)
def test_a_drive_at_once_is_what_its_samples_are_one_by_one(name, method):
    drive, commands = drive_of()
    run = chain_of(CASES[name], method, DRAWS).run(drive, commands=commands)
    rows, samples, estimates = zip(*stepped(chain_of(CASES[name], method), drive, commands))
    assert len(rows) > 100
    assert run.rows[0, : len(rows)].tolist() == list(rows)
    assert run.samples()[: len(rows)] == list(samples)
    assert run.estimates()[: len(rows)] == list(estimates)
    used = [index for index, estimate in enumerate(estimates) if estimate is not None]
    poses = [estimates[index].base_pose_in_odom for index in used]
    np.testing.assert_array_equal(run.poses[0, used], np.array(poses))
    np.testing.assert_array_equal(run.final_poses, run.poses[:, -1])
