"""A short run of every area. The long one: `.venv/bin/python test/fuzz/all.py --minutes 60 --seed 7`."""

import pytest

from all import AREAS, try_case, warm_up
from sandbox import ACCEPTED, REFUSED

CASES = {'lockstep': 5, 'bags': 20, 'robots': 20}  # of an area: those of lockstep take longest
USUALLY = 10
SEED = 1


@pytest.mark.parametrize('area', AREAS)
def test_odd_inputs_are_used_or_refused_in_one_line(area, tmp_path):
    warm_up(area)
    verdicts = [try_case(area, SEED, index, tmp_path) for index in range(CASES.get(area, USUALLY))]
    assert [reason for kind, reason in verdicts if kind not in (ACCEPTED, REFUSED)] == []
    assert len(dict(verdicts)) == 2, 'the inputs are all good, or all hopeless'
