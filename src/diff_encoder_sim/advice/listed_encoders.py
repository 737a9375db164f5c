"""Candidates, and encoders of the catalogue, the shipped robots and the user that meet a requirement on this robot."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Limit, Requirement
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.odometry_answer import own_limits, share_within
from diff_encoder_sim.analysis.statistics import Interval
from diff_encoder_sim.robots.robot_file import load_robot_file, robot_names
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.wheels.catalogue import WHOLE_CATALOGUE, load_encoders
from diff_encoder_sim.wheels.covariance import PULSE_VARIANCE
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS, PerWheel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# Same as FINE_DRAWS of the curve; few draws refuse most insufficient encoders.
DRAWS, FEW_DRAWS = 8000, 500
LISTED_DRAWS = 400


class Candidate(NamedTuple):
    """Candidate encoder."""

    label: str
    counts: float  # of the equivalent ideal encoder
    params: EncoderParams
    name: str = ''  # of a real one, or `own of burger`
    price: Optional[str] = None  # class of its price


def candidates_of(campaign: Campaign) -> List[Candidate]:
    """Return the encoders of a campaign in ascending equivalent counts."""
    found, robot = [], campaign.robot
    own = None if robot.file.ppr is None else PerWheel(left=robot.file.ppr, right=robot.file.ppr)
    for cell in campaign.cells[: len(campaign.encoders)]:
        params, real = cell.robot_params.encoder.model_copy(update={'ppr': cell.encoder.ppr}), cell.encoder.real
        name = cell.encoder.name or (f'own of {robot.name}' if params.ppr == own else '')
        price = real.price if real else None
        found.append(Candidate(cell.encoder.label, equivalent_counts(params), params, name, price))
    return sorted(found, key=lambda candidate: candidate.counts)


def equivalent_counts(params: EncoderParams) -> float:
    """Return the counts of the ideal encoder whose readings have the mean variance of both wheels."""
    left, right = (
        counts * math.sqrt(PULSE_VARIANCE / (PULSE_VARIANCE + params.encoder.pulse_variance(counts)))
        for counts in (params.counts_per_turn.left, params.counts_per_turn.right)
    )
    return left if left == right else math.sqrt(2.0 / (left**-2 + right**-2))


def recommended(
    candidates: Sequence[Candidate], answer: Answer, tests: Sequence[DriveDraws], requirement: Requirement
) -> Optional[Candidate]:
    """Return the smallest candidate whose odometry certainly meets a requirement; None if no candidate does.

    Args:
        candidates: in ascending quality.
        answer: for counts of the robot's encoder.
        tests: one drive per test.
        requirement: at the end of each drive.
    """
    if answer.kind is not Kind.FROM:
        return None
    too_few = answer.interval[0] or 0.0
    for candidate in candidates:
        # Real encoders have errors: their equivalent counts do not exclude them.
        if candidate.counts <= too_few and candidate.label == f'{candidate.counts:g}':
            continue
        is_possible = _worst(tests, candidate.params, FEW_DRAWS, requirement).high >= requirement.share
        if is_possible and _worst(tests, candidate.params, DRAWS, requirement).low >= requirement.share:
            return candidate
    return None


def _worst(tests: Sequence[DriveDraws], params: EncoderParams, count: int, requirement: Requirement) -> Interval:
    """Return the success rate of odometry in the worst test."""
    return min(share_within(draws.errors([params], count)[0], requirement) for draws in tests)


def finest_real(candidates: Sequence[Candidate], answer: Answer) -> Optional[Candidate]:
    """Return the finest real encoder whose counts suffice; None if there is none.

    If it is not recommended, its own errors are too large.
    """
    enough = answer.interval[1] or 0.0
    real = (each for each in reversed(candidates) if each.params.encoder.counts_per_wheel_turn is not None)
    return next((each for each in real if each.params.counts_per_turn.left >= enough), None)


class ListedEncoder(NamedTuple):
    """Encoder on the wheels of this robot."""

    name: str
    price: Optional[str]  # class of its price; None of a robot's own
    ppr: float  # counts per revolution of the wheel
    equivalent_ppr: float  # of the equivalent ideal encoder
    odometry_share: Interval  # success rate in the worst test
    meets: Dict[Criterion, Optional[bool]]  # None: unknown
    limit: Sequence[Limit] = ()  # encoder errors that are too large for odometry

    @property
    def share_text(self) -> str:
        """Return the interval in per cent."""
        return f'{100.0 * self.odometry_share.low:.0f} to {100.0 * self.odometry_share.high:.0f} %'


def listed_encoders(
    tests: Sequence[DriveDraws],
    config_folder: Path,
    requirement: Requirement,
    answers: Mapping[Criterion, Answer],
    candidates: Sequence[Candidate] = (),
) -> List[ListedEncoder]:
    """Return the encoders of config/encoders and config/robots, and candidates with a name, by ascending counts.

    Odometry is sampled with the errors of each encoder. For the pose at the goal, where localization corrects drift, an
    encoder counts as the ideal one with equal variance of a reading.
    """
    catalogue = load_encoders([WHOLE_CATALOGUE], config_folder, Path())
    known: Dict[str, Tuple[Optional[str], EncoderParams]] = {
        each.name: (each.real.price, each.params) for each in catalogue if each.real and each.params
    }
    for robot in robot_names(config_folder):
        ppr = load_robot_file(robot, Path(), config_folder.parent, {}).ppr
        if ppr is not None:
            known[f'own of {robot}'] = None, EncoderParams(ppr=PerWheel(left=ppr, right=ppr))
    known.update({each.name: (each.price, each.params) for each in candidates if each.name})
    found = []
    for name, (price, params) in known.items():
        share, like = _worst(tests, params, LISTED_DRAWS, requirement), equivalent_counts(params)
        meets = {Criterion.ODOMETRY: _met(share, requirement)}
        # The variance of a reading does not contain faults.
        loses_counts = params.encoder.faults.model_copy(update={'max_count_rate': 0.0}) != NO_FAULTS
        for criterion in (Criterion.POSE_ESTIMATE, Criterion.TRUTH):
            meets[criterion] = None if loses_counts else _by_counts(like, answers.get(criterion))
        own: List[Limit] = []
        if meets[Criterion.ODOMETRY] is False:  # by its own errors if its counts suffice
            ideal = params.model_copy(update={'ppr': params.counts_per_turn, 'encoder': IDEAL_ENCODER})
            is_enough = bool(_met(_worst(tests, ideal, LISTED_DRAWS, requirement), requirement))
            own = own_limits(tests, params, requirement, is_enough, LISTED_DRAWS)
        found.append(ListedEncoder(name, price, params.counts_per_turn.left, like, share, meets, own))
    return sorted(found, key=lambda encoder: (encoder.ppr, encoder.name))


def _met(share: Interval, requirement: Requirement) -> Optional[bool]:
    if share.low >= requirement.share:
        return True
    return False if share.high < requirement.share else None


def _by_counts(counts: float, answer: Optional[Answer]) -> Optional[bool]:
    """Return whether the counts suffice; None inside the interval of the answer."""
    if answer is None or answer.kind is Kind.UNDECIDED:
        return None
    not_enough, enough = answer.interval
    if answer.kind is Kind.FROM and enough is not None and counts >= enough:
        return True
    is_too_few = not_enough is not None and counts <= not_enough
    return False if is_too_few or answer.kind is Kind.NOT_THE_LIMIT else None
