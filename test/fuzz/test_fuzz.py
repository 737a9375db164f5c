"""A short run of every area. The long one: `.venv/bin/python test/fuzz/all.py --minutes 60 --seed 7`."""

import pytest

from rounds import AREAS, fuzz
from sandbox import ACCEPTED, REFUSED

CASES = {'lockstep': 5}  # of an area; they take longest there
USUALLY = 20
SEED = 1


@pytest.mark.parametrize('area', AREAS, ids=lambda area: area.name)
def test_odd_inputs_are_used_or_refused_in_one_line(area, tmp_path):
    done = fuzz([area], SEED, cases=CASES.get(area.name, USUALLY), keep=tmp_path)[area.name]
    assert [fallen.reason for fallen in done.fallen] == []
    assert done.counts[ACCEPTED] and done.counts[REFUSED], 'the inputs are all good, or all hopeless'
