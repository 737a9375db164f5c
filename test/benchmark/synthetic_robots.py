"""Robots with random geometry, slip, encoder and drive, and what is asked of them."""

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.advice.answers import Requirement
from diff_encoder_sim.advice.drive_draws import DrawnRobot, DriveDraws, ErrorFreeDrive, drawn_robot, scripted
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.trials.robot_params import load_robot, load_robot_config, override
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from drawn_drives import encoder_of, robot_of, rolled
from generated_robots import Recipe, urdf_of
from places import ROOT

# Every so many-th robot is driven by the simulator.
SIMULATED_EVERY = 5
SHARES = (0.8, 0.95)
# What an encoder of these counts may just reach is asked for, times a factor.
COUNTS, FACTORS = (12.0, 12_000.0), (0.75, 1.5)


class SyntheticRobot(NamedTuple):
    """A robot with an encoder of unknown counts, its drive, and what is asked of it."""

    text: str
    drive: ErrorFreeDrive
    robot: DrawnRobot
    encoder: EncoderParams
    requirement: Requirement


def synthetic_robot(number, folder):
    """Robot `number`; files of simulated ones are written to a folder."""
    rng = np.random.default_rng([16, number])
    radius_m, separation_m = 0.5 * _between(rng, 0.06, 0.4), _between(rng, 0.15, 1.0)
    errors, (encoder_text, encoder) = _wheel_errors(rng), _encoder(rng)
    kind, segments = _segments(rng)
    limits = {'speed': _between(rng, 0.3, 1.0), 'acceleration': 0.7, 'angular_speed': 1.0, 'angular_acceleration': 4.0}
    if number % SIMULATED_EVERY == 0:
        drive, robot = _simulated(folder, radius_m, separation_m, errors, rolled(*segments, **limits))
    else:
        drive = rolled(*segments, separation_m=separation_m, start={'yaw': rng.uniform(-math.pi, math.pi)}, **limits)
        robot = robot_of(radius_m, separation_m, _stop(rng), **errors)
    params = encoder_of(1000, encoder)
    requirement = _requirement(rng, DriveDraws(drive, robot, number), params)
    text = (
        f'{kind} of {drive.wheel_way_m:.1f} m, D {2.0 * radius_m:.2f}, L {separation_m:.2f} m, {encoder_text}, '
        f'{", ".join(f"{key} {value:.1g}" for key, value in errors.items()) or "no errors of the wheels"}'
    )
    return SyntheticRobot(text, drive, robot, params, requirement)


def _between(rng, low, high):
    """Evenly on a logarithmic scale."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _wheel_errors(rng):
    drawn = {
        'left_radius_error': rng.normal(0.0, 3e-4),
        'right_radius_error': rng.normal(0.0, 3e-4),
        'wheel_separation_error': rng.normal(0.0, 2e-3),
        'radius_spread': _between(rng, 1e-5, 1e-3),
        'wheel_separation_spread': _between(rng, 1e-4, 1e-2),
        'left_slip': _between(rng, 1e-5, 1e-3),
        'right_slip': _between(rng, 1e-5, 1e-3),
        'slip_noise': _between(rng, 1e-9, 1e-5),
    }
    return {key: value for key, value in drawn.items() if rng.uniform() < 0.4}


def _encoder(rng):
    kinds = [
        ('ideal', {}),
        ('edges', {'edge_error': rng.uniform(0.05, 0.3)}),
        ('eccentricity', {'eccentricity': _between(rng, 1e-4, 2e-2)}),
        ('missed counts', {'faults': {'missed': _between(rng, 1e-6, 1e-3)}}),
        ('bursts', {'faults': {'missed': _between(rng, 1e-6, 1e-3), 'missed_burst': 20.0, 'extra': 1e-5}}),
        ('hysteresis', {'hysteresis': rng.uniform(0.5, 3.0)}),
        ('backlash', {'side': 'motor', 'gear_ratio': 30.0, 'backlash': _between(rng, 1e-4, 1e-2)}),
        (
            'absolute',
            {'sensor': 'absolute', 'noise': rng.uniform(0.0, 1.0), 'first_harmonic': _between(rng, 0.01, 1.0)},
        ),
        ('hall', {'sensor': 'hall', 'edge_error': rng.uniform(0.05, 0.2)}),
        ('all', {'edge_error': 0.1, 'eccentricity': 1e-3, 'hysteresis': 0.5, 'faults': {'missed': 1e-5}}),
    ]
    weights = np.array([6.0, *np.ones(len(kinds) - 1)])
    return kinds[rng.choice(len(kinds), p=weights / weights.sum())]


def _segments(rng):
    kind = ('line', 'turns', 'route')[rng.integers(3)]
    sign = 1.0 if rng.uniform() < 0.5 else -1.0
    if kind == 'line':
        return kind, [('straight', _between(rng, 2.0, 30.0))]
    if kind == 'turns':
        return kind, [('turns', sign * _between(rng, 0.25, 5.0))]
    segments = []
    for _ in range(rng.integers(2, 5)):
        segments += [('straight', rng.uniform(0.5, 5.0)), ('turns', rng.uniform(-0.4, 0.4))]
    return kind, segments


def _stop(rng):
    if rng.uniform() < 0.2:
        return StopSpread(0.09, 0.1)  # latched within tolerances
    return StopSpread(rng.uniform(0.003, 0.03), rng.uniform(0.005, 0.05))


def _simulated(folder, radius_m, separation_m, errors, like):
    """The drive by the simulator, and the robot as it is read of its files."""
    size_m = 0.7 * separation_m
    recipe = Recipe(
        mass_kg=20.0 * separation_m,
        com_m=(-0.1 * size_m, 0.0, radius_m),
        body_m=(size_m, 0.5 * size_m, 0.1),
        body_x_m=-0.2 * size_m,
        radius_m=radius_m,
        separation_m=separation_m,
        wheel_mass_kg=0.5 * separation_m,
        casters_m=((-0.5 * size_m, 0.0),),
        laser_m=(0.0, 0.0, 2.0 * radius_m + 0.2),
    )
    path = folder / f'{radius_m:.9f}.urdf'
    path.write_text(urdf_of(recipe, folder), encoding='utf-8')
    setup = load_robot(str(path), folder, ROOT, {})
    params = override(
        load_robot_config(ROOT / 'config'),
        {**setup.settings, **{f'simulator.wheel_errors.{key}': value for key, value in errors.items()}},
    )
    source = setup.file.source
    return scripted(like.requested.test, source, params), drawn_robot(source, params)


def _requirement(rng, draws, params):
    """What an encoder of random counts can just do, more, or less."""
    share = SHARES[rng.integers(len(SHARES))]
    counts = float(round(_between(rng, *COUNTS)))
    step = params.encoder.counts_that_repeat * params.encoder.shaft_turns_per_wheel_turn
    ppr = step * max(1, round(counts / step))
    (errors,) = draws.errors([params.model_copy(update={'ppr': encoder_of(ppr).ppr})], 400)
    shown = np.abs(errors)
    factor = _between(rng, *FACTORS)
    position_m = factor * float(np.quantile(shown[:, :2].max(axis=1), share))
    yaw_rad = factor * rng.uniform(1.0, 2.0) * float(np.quantile(shown[:, 2], share))
    return Requirement(share, _rounded(position_m), math.radians(_rounded(math.degrees(yaw_rad))), 0.95)


def _rounded(value):
    """As people write a tolerance; not finer than what can be asked for."""
    return max(1e-5, float(f'{value:.2g}'))
