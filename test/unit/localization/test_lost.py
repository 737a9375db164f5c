"""Lost and found: the decision over scans."""

import numpy as np

from amcl_world import ELSEWHERE, START, pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.scan_fit import LostDetector

ROOM = pillar_room()


def test_the_decision_needs_scans_in_a_row():
    detector = LostDetector(AmclParams(lost_fraction=0.5, lost_scans=3), ROOM)
    good, bad = simulated_scan(ROOM, START), simulated_scan(ROOM, ELSEWHERE)
    none = good._replace(ranges_m=np.full(180, np.inf))
    seen = []
    for scan in (bad, bad, good, bad, none, bad, bad, good, good, bad, good, good, good):
        detector.check(START, scan, IDENTITY, may_be_found=True)
        seen.append(detector.is_lost)
    assert seen == [False] * 6 + [True] * 6 + [False]


def test_to_be_found_takes_a_larger_fraction_than_not_to_be_lost():
    detector = LostDetector(AmclParams(lost_fraction=0.5, lost_scans=1), ROOM)
    ranges = simulated_scan(ROOM, START).ranges_m.copy()
    ranges[:140] = 0.5
    so_so = simulated_scan(ROOM, START)._replace(ranges_m=ranges)
    detector.check(START, so_so, IDENTITY, may_be_found=True)
    assert 0.5 < detector.fit_fraction < 0.75 and not detector.is_lost
    detector.declare_lost()
    detector.check(START, so_so, IDENTITY, may_be_found=True)
    assert detector.is_lost and detector.least_fraction == 0.75
    detector.check(START, simulated_scan(ROOM, START), IDENTITY, may_be_found=False)
    assert detector.is_lost
    detector.check(START, simulated_scan(ROOM, START), IDENTITY, may_be_found=True)
    assert not detector.is_lost
