"""Why odometry of one drive is off its reference: encoder, calibration, slip or the reference."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries, wrap_angles
from diff_encoder_sim.calibration.estimation import Calibration, ReferencedDrive, calibrate, track_of
from diff_encoder_sim.calibration.likelihood import NAMES, NOISE
from diff_encoder_sim.calibration.umbmark import WheelGeometry
from diff_encoder_sim.drives.comparison import SensorPlace, of_reference

special = deferred('scipy.special')

GROUPS = ('encoder', 'calibration', 'slip', 'place of the reference', 'reference', 'rest')
ENCODER, CALIBRATION, SLIP, PLACE, REFERENCE, REST = GROUPS
# What a drive may contradict, by rows of OFFSETS: logarithms of mean diameter, right / left diameter and separation;
# x, y, yaw and delay of the reference's sensor.
OFFSETS = np.eye(7)
OFFSETS[:2, :2] = [[0.5, 0.5], [-1.0, 1.0]]
ASSUMPTIONS = {
    'distances are {:+.2f} % off: check the wheel diameters': [0],
    'the heading drifts by {:.2f} degrees per metre: check the right / left wheel diameter': [1],
    'the heading drifts by {:.2f} degrees per turn: check the wheel separation': [2],
    PLACE: [3, 4, 5, 6],
}
BY_CHANCE = 1e-3  # probability of a deviation that is not significant
PER_OFFSET = 4.0  # squared deviation that another offset must explain
MATERIAL, MAIN = 0.1, 0.5  # fractions of the mean square error: of a cause that is named, of the main one
LUCK = 10.8  # mean square error by its expected value: one drive in 1000 has more, if one heading error decides


class ComparedDrive(NamedTuple):
    """A drive with its reference, and the assumptions of its odometry."""

    parts: Sequence[ReferencedDrive]  # several if the stamps go back
    geometry: WheelGeometry
    axle_x_m: float
    place: SensorPlace
    is_own_clock: bool  # of the reference, as in `of_reference`
    is_guessed: bool  # the geometry: only its relative corrections have a meaning
    geometry_covariance: np.ndarray  # (3, 3) of the logarithms of `geometry`; 0 if unknown
    slip: Optional[Tuple[float, float]]  # [m^2/m], [rad^2/rad] of the robot; None if unknown

    def along(self, changes: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return `Comparison.along` of odometry by the recorded angles, with the assumptions changed (7,)."""
        geometry, place = self.changed(changes)
        drives = [part.drive for part in self.parts]
        paths = [PoseSeries(each.stamps_ns, geometry.path(each.wheel_angles_rad, self.axle_x_m)) for each in drives]
        return of_reference([part.reference for part in self.parts], place, self.is_own_clock).along(paths)

    def changed(self, changes: np.ndarray) -> Tuple[WheelGeometry, SensorPlace]:
        """Return the assumptions changed by offsets (7,)."""
        of_geometry, of_place = np.split(np.linalg.solve(OFFSETS, changes), [3])
        pose = Pose2D(*np.add(self.place.pose, of_place[:3]).tolist())
        geometry = WheelGeometry(*(self.geometry * np.exp(of_geometry)).tolist())
        return geometry, SensorPlace(pose, self.place.delay_s + float(of_place[3]))


class EncoderError(NamedTuple):
    """Error of an encoder on a drive."""

    name: str  # in a sentence
    quantisation_m2: float  # mean squared distance from odometry by the recorded angles, over start angles
    ate_m: float  # median over start angles


class Cause(NamedTuple):
    """A part of the mean square error."""

    group: str
    mean_square_m2: float
    text: str = ''
    is_significant: bool = False  # a correction of the wheels, which is named even if it changes little on this drive


class DriveCauses(NamedTuple):
    """The error in parts, and the conclusion."""

    conclusion: List[str]  # sentences
    budgets: List[Dict[str, float]]  # mean square error [m^2] by GROUPS, of each encoder
    corrected: Optional[Tuple[np.ndarray, np.ndarray]] = None  # `Comparison.along` with the significant corrections


def find_causes(
    drive: ComparedDrive, encoders: Sequence[EncoderError], recorded: Optional[EncoderError]
) -> DriveCauses:
    """Split the mean square error of the position; `recorded` is the encoder that counted, None of angles."""
    causes: List[Cause] = []
    changes, fit, why = np.zeros(7), None, ''
    counts = Cause(ENCODER, recorded.quantisation_m2 if recorded else 0.0)
    try:
        fit = calibrate(drive.parts, drive.geometry)
        causes, changes = _corrections(drive, fit, counts.mean_square_m2)
    except ConfigError as error:
        why = f'the other causes are unknown: {error}'
    times_s, pairs = drive.along(changes)
    of_chance = [counts, *_of_chance(drive, pairs, fit)]
    left_m2, expected_m2 = _mean_square(pairs), sum(cause.mean_square_m2 for cause in of_chance)
    explained_m2 = left_m2 if left_m2 <= LUCK * expected_m2 else expected_m2
    scale = explained_m2 / max(expected_m2, 1e-30)
    spans = [f'{each.start_s:.0f} to {each.end_s:.0f} s' for each in fit.disturbances] if fit else []
    rest = f'the robot was pushed or slipped, or the reference jumped, at {", ".join(spans[:3])}'
    causes += [cause._replace(mean_square_m2=scale * cause.mean_square_m2) for cause in of_chance]
    causes.append(Cause(REST, left_m2 - explained_m2, rest if spans else 'not a constant error, slip or noise'))
    total = {group: sum(each.mean_square_m2 for each in causes if each.group == group) for group in GROUPS}
    budgets = [{**total, ENCODER: total[ENCODER] + encoder.quantisation_m2} for encoder in encoders]
    share = total[ENCODER] / max(sum(total.values()), 1e-30)
    text = f'the recorded encoder is {_part_text(recorded, share)}' if recorded and share >= MATERIAL else ''
    texts = [text or _encoder_text(encoders, budgets), *([why] if why else _cause_texts(causes))]
    sentences = [f'{text[0].upper()}{text[1:]}.' for text in texts]
    return DriveCauses(sentences, budgets, (times_s, pairs) if changes.any() else None)


def _mean_square(pairs: np.ndarray) -> float:
    return float(np.square(pairs[:, :2] - pairs[:, 3:5]).sum() / max(1, len(pairs)))


def _corrections(drive: ComparedDrive, fit: Calibration, least_m2: float) -> Tuple[List[Cause], np.ndarray]:
    """Return the assumptions that the drive contradicts, by what each adds to its error, and all corrections (7,).

    The fewest offsets that explain the deviation of the assumptions from the `fit` are wrong, and the others right. A
    correction that reduces the mean square error by `least_m2` or less is left out.
    """
    (x_m, y_m, yaw_rad), delay_s = drive.place
    assumed = np.array([*np.log(drive.geometry), x_m - drive.axle_x_m, y_m, yaw_rad, delay_s])
    off = OFFSETS @ (assumed - fit.parameters[:7])
    off[5] = wrap_angles(off[5])
    covariance = (fit.uncertainty.expected + fit.uncertainty.observed)[:7, :7]  # at least the larger one
    free = set(np.flatnonzero(np.diag(covariance)).tolist())
    covariance[:3, :3] += drive.geometry_covariance
    covariance = OFFSETS @ covariance @ OFFSETS.T

    def of_right(wrong: Sequence[int]) -> Tuple[List[int], np.ndarray]:
        right = sorted(free.difference(wrong))
        return right, np.linalg.solve(covariance[np.ix_(right, right)], off[right])

    def squared(wrong: Sequence[int]) -> float:
        right, weighted = of_right(wrong)
        return float(off[right] @ weighted)

    found: Dict[str, List[int]] = {}
    wrong: List[int] = []
    while squared(wrong) > special.chdtri(max(1, len(free.difference(wrong))), BY_CHANCE):
        costs = {text: squared(wrong + some) + PER_OFFSET * len(some) for text, some in ASSUMPTIONS.items()}
        best = min(costs.keys() - found.keys(), key=lambda text: costs[text])
        found[best] = ASSUMPTIONS[best]
        wrong = sorted(free.intersection(wrong + found[best]))
    right, weighted = of_right(wrong)
    gain = np.linalg.solve(covariance[np.ix_(right, right)], covariance[np.ix_(right, wrong)])
    changes, stds = np.zeros(7), np.zeros(7)
    changes[wrong] = covariance[np.ix_(wrong, right)] @ weighted - off[wrong]
    stds[wrong] = np.sqrt(np.diag(covariance[np.ix_(wrong, wrong)] - covariance[np.ix_(wrong, right)] @ gain))
    causes: List[Cause] = []
    applied, before_m2 = np.zeros(7), _mean_square(drive.along(np.zeros(7))[1])
    for name in sorted(found, key=lambda each: each != PLACE):  # first, as it is no error of odometry
        tried = np.where(np.isin(np.arange(7), found[name]), changes, applied)
        gained_m2 = before_m2 - _mean_square(drive.along(tried)[1])
        group, text = PLACE if name == PLACE else CALIBRATION, _correction_text(drive, name, changes, stds)
        if gained_m2 > least_m2:
            applied, before_m2 = tried, before_m2 - gained_m2
        if gained_m2 > least_m2 or group == CALIBRATION:
            causes.append(Cause(group, gained_m2 if tried is applied else 0.0, text, group == CALIBRATION))
    return causes, applied


def _correction_text(drive: ComparedDrive, name: str, changes: np.ndarray, stds: np.ndarray) -> str:
    if name == PLACE:
        _, ((x_m, y_m, yaw_rad), delay_s) = drive.changed(changes)
        options = f'--reference-pose {x_m:.3f} {y_m:.3f} {yaw_rad:.3f} --reference-delay {delay_s:.3f}'
        return f'the sensor of the reference is not where it is assumed: give {options}'
    (index,) = ASSUMPTIONS[name]
    change, reach, separation_m = float(changes[index]), 1.96 * float(stds[index]), drive.geometry.separation_m
    factor, low, high = (math.exp(change + side * reach) for side in (0.0, -1.0, 1.0))
    shown = (100.0 * (1.0 / factor - 1.0), -math.degrees(change) / separation_m, 360.0 * (factor - 1.0))[index]
    times = '' if index == 1 and drive.is_guessed else f': {factor:.4f} ({low:.4f} to {high:.4f}) times the assumed one'
    return name.format(shown) + times


def _of_chance(drive: ComparedDrive, pairs: np.ndarray, fit: Optional[Calibration]) -> List[Cause]:
    """Return the expected errors that differ from drive to drive."""
    causes, slip = [], drive.slip or (0.0, 0.0)
    if fit:
        slip = drive.slip or (fit.values['slip_m2_per_m'].value, fit.values['slip_rad2_per_rad'].value)
        precisions = np.linalg.inv(track_of(drive.parts[0]).covariances)  # the noise is relative to their mean
        variances = np.linalg.inv(precisions.mean(axis=0)).diagonal()
        scales = dict(zip(NAMES[NOISE], np.exp(2.0 * fit.parameters[NOISE]).tolist()))
        noise_m2 = (scales['white_std'] + scales['slow_std']) * float(variances[:2].sum())
        if len(variances) == 3:  # the first pose moves and turns the path
            yaw_rad2 = (scales['white_yaw_std'] + scales['slow_yaw_std']) * float(variances[2])
            noise_m2 = 2.0 * noise_m2 + yaw_rad2 * float(np.square(pairs[:, 3:5]).sum(axis=1).mean())
        causes.append(Cause(REFERENCE, noise_m2, 'noise of the reference'))
    slip_m2 = _slip_m2(pairs, *slip, drive.geometry.separation_m)
    causes.append(Cause(SLIP, slip_m2, f'wheel slip, {1e3 * math.sqrt(slip[0]):.1f} mm after 1 m'))
    variances, directions = np.linalg.eigh(drive.geometry_covariance)
    offsets = OFFSETS[:3, :3] @ (directions * np.sqrt(variances.clip(0.0)))
    paths = [drive.along(np.append(offset, np.zeros(4)))[1][:, :2] for offset in (np.zeros(3), *offsets.T)]
    off_m2 = sum(float(np.square(path - paths[0]).sum(axis=1).mean()) for path in paths)
    return [*causes, Cause(CALIBRATION, off_m2, 'the interval of the calibration: calibrate with more drives')]


def _slip_m2(pairs: np.ndarray, m2_per_m: float, rad2_per_rad: float, separation_m: float) -> float:
    """Return the mean variance of the position [m^2]: an error of the heading turns the path that follows."""
    places = pairs[:, 0] + 1j * pairs[:, 1]
    turns_rad = abs(wrap_angles(np.diff(pairs[:, 2], prepend=pairs[:1, 2])))
    ways_m = np.maximum(2.0 * abs(np.diff(places, prepend=places[:1])), separation_m * turns_rad)  # of both wheels
    yaws_rad2 = m2_per_m * ways_m / separation_m**2 + rad2_per_rad * turns_rad
    ones, firsts, seconds = (np.cumsum(yaws_rad2 * each) for each in (1.0, places, abs(places) ** 2))
    variances_m2 = abs(places) ** 2 * ones - 2.0 * (places.conj() * firsts).real + seconds
    return float((variances_m2 + 0.25 * m2_per_m * np.cumsum(ways_m)).mean())


def _encoder_text(encoders: Sequence[EncoderError], budgets: Sequence[Dict[str, float]]) -> str:
    """Compare the encoders."""
    shares = [budget[ENCODER] / max(sum(budget.values()), 1e-30) for budget in budgets]
    order = sorted(zip(shares, encoders), key=lambda each: -each[0])
    (share, coarse), (_, fine) = order[0], order[-1]
    if share < MATERIAL:
        errors = [f'{each.ate_m:.2g} m with {each.name}' for each in dict.fromkeys((coarse, fine))]
        return f'the encoder is not the cause: the error over the drive is {", ".join(errors)}'
    finer = next((f'; with {each.name}, {100.0 * part:.0f} %' for part, each in order if part < MATERIAL), '')
    return f'the encoder is {_part_text(coarse, share)}{finer}'


def _part_text(encoder: EncoderError, share: float) -> str:
    role = 'the main cause' if share >= MAIN else 'a cause'
    return f'{role} with {encoder.name}: {100.0 * share:.0f} % of the mean square error'


def _cause_texts(causes: Sequence[Cause]) -> List[str]:
    """Name the causes other than the encoder."""
    others = sorted((each for each in causes if each.group != PLACE), key=lambda each: -each.mean_square_m2)
    total_m2 = sum(each.mean_square_m2 for each in others)
    texts = [each.text for each in causes if each.group == PLACE and each.mean_square_m2 > MATERIAL * total_m2]
    named = [each for each in others if each.is_significant or each.mean_square_m2 > MATERIAL * total_m2]
    named = [each for each in named if each.group != ENCODER]
    if not any(each.is_significant for each in named):
        texts.append('no error of the wheel geometry is significant')
    heads = ['largest other cause', *['next'] * len(named)]
    parts = [
        f'{each.text} ({100.0 * each.mean_square_m2 / max(total_m2, 1e-30):.0f} % of the other error)' for each in named
    ]
    return [*texts, *(f'{head}: {part}' for head, part in zip(heads, parts))]
