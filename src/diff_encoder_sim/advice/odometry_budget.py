"""The budget of odometry's own error: each cause by itself, in the same draws of one drive."""

from __future__ import annotations

from typing import Dict, List, Optional, Sequence

import numpy as np

from diff_encoder_sim.advice.budget import Budget, Part, added, part_of
from diff_encoder_sim.advice.drawn_robot import ALL_CAUSES, Amounts, WheelCause
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.requirement import along_goal
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

QUANTISATION, EDGES, MISSED = 'quantisation', 'edge errors', 'missed counts'
ENCODER_CAUSES = (EDGES, MISSED)  # besides its steps

# The keys of an encoder that make EDGES, in proportion to their values; with those of uneven lines, all of them.
SENSOR_ERRORS = (
    *('edge_error', 'sensor_error', 'eccentricity', 'first_harmonic', 'second_harmonic'),
    *('noise', 'hysteresis', 'backlash'),
)
UNEVEN_LINES = ('duty_cycle', 'phase_error')

DRAWS = 1000


def odometry_budgets(draws: DriveDraws, encoders: Sequence[EncoderParams]) -> List[Budget]:
    """Return the budget with each encoder.

    What simulated wheels slip on the simulated floor is a part of its own: it is the simulator's, not the robot's.
    """
    count = len(encoders)
    of_encoders = [*map(_ideal, encoders), *map(_without_faults, encoders), *encoders]
    bare, *errors = _errors(draws, [None, *of_encoders], {})
    ideal, sound, faulty = errors[:count], errors[count : 2 * count], errors[2 * count :]
    found = _errors(draws, encoders, ALL_CAUSES)
    others = wheel_parts(draws)
    return [
        Budget({**_encoder_parts(encoder, bare, *of_encoder), **others}, part_of(total))
        for encoder, *of_encoder, total in zip(encoders, ideal, sound, faulty, found)
    ]


def wheel_parts(draws: DriveDraws) -> Dict[str, Part]:
    """Return what each error of the wheels adds, whatever the encoder."""
    return {cause.value: part_of(errors) for cause, errors in wheel_errors(draws).items()}


def wheel_errors(draws: DriveDraws) -> Dict[WheelCause, np.ndarray]:
    """Return (draws, 3) the errors of odometry, by the axes of budgets, that each error of the wheels makes alone."""
    (bare,) = _errors(draws, [None], {})
    return {cause: _errors(draws, [None], {cause: 1.0})[0] - bare for cause in WheelCause if draws.robot.has(cause)}


def encoder_errors(draws: DriveDraws, encoder: EncoderParams, count: int = DRAWS) -> Dict[str, np.ndarray]:
    """Return (draws, 3) the same for each kind of error of an encoder, beside its steps."""
    of_steps, sound, faulty = _errors(draws, [_ideal(encoder), _without_faults(encoder), encoder], {}, count)
    found = {EDGES: sound - of_steps, MISSED: faulty - sound}
    return {cause: errors for cause, errors in found.items() if errors.any()}


def _errors(
    draws: DriveDraws, encoders: Sequence[Optional[EncoderParams]], amounts: Amounts, count: int = DRAWS
) -> List[np.ndarray]:
    goal = draws.drive.goal_in_map
    return [along_goal(errors, goal) for errors in draws.errors(encoders, count, amounts)]


def _encoder_parts(
    encoder: EncoderParams, bare: np.ndarray, ideal: np.ndarray, sound: np.ndarray, faulty: np.ndarray
) -> Dict[str, Part]:
    parts = {QUANTISATION: part_of(ideal - bare)}
    if _without_faults(encoder).encoder != IDEAL_ENCODER:
        # An edge in another place is counted sooner or later, which depends on the rounding: not as a draw by itself.
        parts[EDGES] = added(sound, ideal)
    if encoder.encoder.faults != NO_FAULTS:
        parts[MISSED] = part_of(faulty - sound)
    return parts


def _ideal(encoder: EncoderParams) -> EncoderParams:
    """Return an encoder of as many counts without errors."""
    return encoder.model_copy(update={'ppr': encoder.counts_per_turn, 'encoder': IDEAL_ENCODER})


def _without_faults(encoder: EncoderParams) -> EncoderParams:
    return encoder.model_copy(update={'encoder': encoder.encoder.model_copy(update={'faults': NO_FAULTS})})
