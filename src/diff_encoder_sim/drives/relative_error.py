"""Relative pose error (RPE) by distance, with both of evo's conventions for the pairs of poses."""

from __future__ import annotations

import enum
from typing import Dict

import numpy as np

from diff_encoder_sim.base.pose_series import steps_m
from diff_encoder_sim.drives.rpe_segments import AllSegments, ConsecutiveSegments, RelativeError, planar_pairs

# Lengths of segments.
RPE_DISTANCES_M = (1.0, 5.0, 10.0)


class RpePairs(str, enum.Enum):
    """Which poses are the ends of segments, by evo's names."""

    CONSECUTIVE = 'consecutive'  # segments end to end, from the first pose on
    ALL = 'all_pairs'  # a segment from every pose on

    @property
    def text(self) -> str:
        """Name the convention in a sentence."""
        return self.value.replace('_', ' ')


def rpe_name(pairs: RpePairs, distance_m: float) -> str:
    """Begin the names of the columns of one RPE: rpe_10m for consecutive pairs, rpe_10m_all_pairs."""
    return f'rpe_{distance_m:g}m' + ('' if pairs is RpePairs.CONSECUTIVE else f'_{pairs.value}')


class RunningRelativeErrors:
    """RPE over all of RPE_DISTANCES_M with both conventions, as pairs of poses come."""

    def __init__(self) -> None:
        self.length_m = 0.0  # of the reference
        self._last = np.empty((0, 6))  # one row, once there is a pair
        self._consecutive = {distance_m: ConsecutiveSegments(distance_m) for distance_m in RPE_DISTANCES_M}
        self._all = {distance_m: AllSegments(distance_m) for distance_m in RPE_DISTANCES_M}

    def restart(self) -> None:
        """Begin another path with the next pair; no segment reaches across."""
        self._last = self._last[:0]
        for distance_m in RPE_DISTANCES_M:
            self._consecutive[distance_m].restart()
            self._all[distance_m].restart()

    def add(self, pairs: np.ndarray) -> None:
        """Take the next pairs, at least one: (n, 6) x [m], y [m], yaw [rad] of estimate and reference."""
        steps = steps_m(np.concatenate((self._last if len(self._last) else pairs[:1], pairs))[:, 3:])
        # Summed from pose to pose, as evo does, and not anew in each block.
        lengths_m = np.cumsum(np.concatenate(([self.length_m], steps)))[1:]
        self.length_m, self._last = float(lengths_m[-1]), pairs[-1:]
        planar = planar_pairs(pairs)
        # A robot that stands repeats itself: such pairs are kept once, with their count.
        firsts = np.flatnonzero(np.concatenate(([True], (planar[1:] != planar[:-1]).any(axis=1))))
        distinct = lengths_m[firsts], planar[firsts], np.diff(firsts, append=len(planar))
        step_list = steps.tolist()
        for distance_m in RPE_DISTANCES_M:
            self._consecutive[distance_m].add(step_list, planar)
            self._all[distance_m].add(*distinct)

    def results(self) -> Dict[RpePairs, Dict[float, RelativeError]]:
        """Return the errors over all pairs so far, by length of the segments [m]."""
        return {
            RpePairs.CONSECUTIVE: {distance_m: one.result() for distance_m, one in self._consecutive.items()},
            RpePairs.ALL: {distance_m: one.result() for distance_m, one in self._all.items()},
        }
