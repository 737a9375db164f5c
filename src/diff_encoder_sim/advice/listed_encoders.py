"""Encoders of the catalogue, the shipped robots and the user that meet a requirement on this robot."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Limit, Requirement
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.odometry_answer import own_limits
from diff_encoder_sim.advice.odometry_curve import share_within
from diff_encoder_sim.analysis.statistics import Interval
from diff_encoder_sim.robots.robot_file import load_robot_file, robot_names
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.wheels.catalogue import WHOLE_CATALOGUE, load_encoders
from diff_encoder_sim.wheels.covariance import PULSE_VARIANCE
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS, PerWheel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# Same as FINE_DRAWS of the curve.
DRAWS = 8000
# Enough draws to refuse most insufficient encoders.
FEW_DRAWS = 500


class Candidate(NamedTuple):
    """Candidate encoder."""

    label: str
    counts: float  # of the equivalent ideal encoder
    params: EncoderParams
    name: str = ''  # of a real one, or `own of burger`
    price: str = ''  # class of its price


def candidates_of(campaign: Campaign) -> List[Candidate]:
    """Return the encoders of a campaign in ascending equivalent counts."""
    found = []
    for cell in campaign.cells[: len(campaign.encoders)]:
        params = cell.robot_params.encoder.model_copy(update={'ppr': cell.ppr})
        counts, real, ppr = equivalent_counts(params), cell.encoder.real, campaign.robot.file.ppr
        found.append(Candidate(cell.encoder.label, counts, params))
        if real:
            found[-1] = found[-1]._replace(name=real.stem, price=real.price)
        elif ppr and params.ppr == PerWheel(left=ppr, right=ppr):
            found[-1] = found[-1]._replace(name=f'own of {campaign.robot.name}')
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
    """Return the smallest candidate whose odometry suffices; None if no candidate suffices."""
    if answer.kind is not Kind.FROM:
        return None
    too_few = answer.interval[0] or 0.0
    # Real encoders have errors: their equivalent counts do not exclude them.
    possible = [each for each in candidates if each.counts > too_few or each.label != f'{each.counts:g}']
    return smallest_enough(possible, tests, requirement)


def finest_real(candidates: Sequence[Candidate], answer: Answer) -> Optional[Candidate]:
    """Return the finest real encoder whose counts suffice; None if there is none.

    If it is not recommended, its own errors are too large.
    """
    enough = answer.interval[1] or 0.0
    real = (each for each in reversed(candidates) if each.params.encoder.counts_per_wheel_turn is not None)
    return next((each for each in real if each.params.counts_per_turn.left >= enough), None)


def smallest_enough(
    candidates: Sequence[Candidate], tests: Sequence[DriveDraws], requirement: Requirement
) -> Optional[Candidate]:
    """Return the first candidate whose odometry certainly meets a requirement; None if no candidate does.

    Args:
        candidates: in the order of testing.
        tests: one drive per test.
        requirement: at the end of each drive.
    """

    def shares(candidate: Candidate, count: int) -> Iterator[Interval]:
        return (share_within(draws.errors([candidate.params], count)[0], requirement) for draws in tests)

    for candidate in candidates:
        is_possible = all(share.high >= requirement.share for share in shares(candidate, FEW_DRAWS))
        if is_possible and all(share.low >= requirement.share for share in shares(candidate, DRAWS)):
            return candidate
    return None


LISTED_DRAWS = 400


class ListedEncoder(NamedTuple):
    """Encoder on the wheels of this robot."""

    name: str
    price: str  # class of its price; '' of a robot's own
    counts: float  # per revolution of the wheel
    equivalent_counts: float  # of the equivalent ideal encoder
    share: Interval  # success rate of odometry in the worst test
    meets: Dict[Criterion, Optional[bool]]  # None: unknown
    limits: Sequence[Limit] = ()  # encoder errors that are too large for odometry

    @property
    def share_text(self) -> str:
        """Return the interval in per cent."""
        return f'{100.0 * self.share.low:.0f} to {100.0 * self.share.high:.0f} %'


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
    found = []
    known = {**_known(config_folder), **{each.name: (each.price, each.params) for each in candidates if each.name}}
    for name, (price, params) in known.items():
        share = min(share_within(draws.errors([params], LISTED_DRAWS)[0], requirement) for draws in tests)
        like = equivalent_counts(params)
        meets = {Criterion.ODOMETRY: _met(share, requirement)}
        for criterion in (Criterion.POSE_ESTIMATE, Criterion.TRUTH):
            meets[criterion] = None if _loses_counts(params) else _by_counts(like, answers.get(criterion))
        own = _own_limits(tests, params, requirement) if meets[Criterion.ODOMETRY] is False else []
        found.append(ListedEncoder(name, price, params.counts_per_turn.left, like, share, meets, own))
    return sorted(found, key=lambda encoder: (encoder.counts, encoder.name))


def _loses_counts(params: EncoderParams) -> bool:
    """Return whether an encoder has faults, which the variance of a reading does not contain."""
    return params.encoder.faults.model_copy(update={'max_count_rate': 0.0}) != NO_FAULTS


def _own_limits(tests: Sequence[DriveDraws], params: EncoderParams, requirement: Requirement) -> List[Limit]:
    """Return the encoder errors that are too large; none if its counts are too low."""
    ideal = params.model_copy(update={'ppr': params.counts_per_turn, 'encoder': IDEAL_ENCODER})
    share = min(share_within(draws.errors([ideal], LISTED_DRAWS)[0], requirement) for draws in tests)
    return own_limits(tests, params, requirement, bool(_met(share, requirement)), LISTED_DRAWS)


def _known(config_folder: Path) -> Dict[str, Tuple[str, EncoderParams]]:
    """Return price class and parameters by name."""
    catalogue = load_encoders([WHOLE_CATALOGUE], config_folder, Path())
    found = {encoder.stem: (encoder.price, encoder.params) for encoder in catalogue}
    for name in robot_names(config_folder):
        ppr = load_robot_file(name, Path(), config_folder.parent, {}).ppr
        if ppr is not None:
            found[f'own of {name}'] = '', EncoderParams(ppr=PerWheel(left=ppr, right=ppr))
    return found


def _met(share: Interval, requirement: Requirement) -> Optional[bool]:
    if share.low >= requirement.share:
        return True
    return False if share.high < requirement.share else None


def _by_counts(counts: float, answer: Optional[Answer]) -> Optional[bool]:
    """Return whether the counts suffice; None inside the interval of the answer."""
    if answer is None or answer.kind is Kind.UNDECIDED:
        return None
    if answer.kind is Kind.NOT_THE_LIMIT:
        return False
    not_enough, enough = answer.interval
    if enough is not None and counts >= enough:
        return True
    return False if not_enough is not None and counts <= not_enough else None
