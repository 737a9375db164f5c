"""Uses the package with odd inputs, area by area, and prints what fell; inputs of what fell are kept.

    .venv/bin/python test/fuzz/all.py --minutes 60 --seed 7                 all areas
    .venv/bin/python test/fuzz/all.py --areas worlds --seed 7 --case 123    one case again, in this process

The status is 1 if anything fell.
"""

import argparse
import contextlib
import io
import shutil
import sys
import tempfile
import time
import zlib
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
KEEP = ROOT / 'results' / 'fuzz'
# The package last: with the workspace sourced it comes through catkin.
sys.path += [str(ROOT / 'test' / 'support'), str(ROOT / 'test'), str(ROOT / 'src')]

import fuzz_bags
import fuzz_campaigns
import fuzz_encoders
import fuzz_lockstep
import fuzz_maps
import fuzz_robots
import fuzz_worlds
from sandbox import ACCEPTED, FALLEN, REFUSED, judge, run_in_sandbox

# Each makes an odd input from a generator in a folder, and uses it (`run`), and loads what every case needs before
# cases are forked (`warm_up`).
AREAS = {
    'encoders': fuzz_encoders,
    'lockstep': fuzz_lockstep,
    'worlds': fuzz_worlds,
    'robots': fuzz_robots,
    'maps': fuzz_maps,
    'bags': fuzz_bags,
    'campaigns': fuzz_campaigns,
}
CPU_S = {'lockstep': 60, 'bags': 60}  # allowed for a case
USUAL_CPU_S = 20


def warm_up(area):
    with tempfile.TemporaryDirectory(prefix='fuzz_') as folder, contextlib.redirect_stdout(io.StringIO()):
        AREAS[area].warm_up(Path(folder))


def try_case(area, seed, index, keep):
    """Try one case in the sandbox and return the verdict; inputs of one that falls go below the folder `keep`."""
    with tempfile.TemporaryDirectory(prefix='fuzz_') as name:
        folder = Path(name)
        run = lambda: AREAS[area].run(generator(area, seed, index), folder)  # noqa: E731
        verdict = run_in_sandbox(run, folder, CPU_S.get(area, USUAL_CPU_S))
        if verdict.kind == FALLEN:
            shutil.copytree(folder, keep / f'{area}_{seed}_{index}', symlinks=True)
    return verdict


def generator(area, seed, index):
    """Return the generator of a case: the same for the same seed, whatever else is tried."""
    return np.random.default_rng([seed, zlib.crc32(area.encode()), index])


def fuzz(areas, seed, minutes, keep):
    """Share the minutes among the areas; return the verdicts of each area."""
    verdicts, spent_s = {area: [] for area in areas}, dict.fromkeys(areas, 0.0)
    for area in areas:
        warm_up(area)
    end_s = time.monotonic() + 60.0 * minutes
    while time.monotonic() < end_s:
        area, began_s = min(areas, key=spent_s.get), time.monotonic()
        index = len(verdicts[area])
        verdicts[area].append(try_case(area, seed, index, keep))
        spent_s[area] += time.monotonic() - began_s
        if verdicts[area][-1].kind == FALLEN:
            print(f'\n{area} {index} fell: {verdicts[area][-1].reason.strip()}', flush=True)
    return verdicts


def main():
    options = parse()
    if options.case is not None:
        for area in options.areas:
            warm_up(area)
            folder = Path(tempfile.mkdtemp(prefix='fuzz_'))
            print(f'inputs: {folder}')
            print(area, *judge(lambda: AREAS[area].run(generator(area, options.seed, options.case), folder)))
        return
    print(f'{"area":12} {ACCEPTED:>9} {REFUSED:>8} {FALLEN:>7}')
    verdicts = fuzz(options.areas, options.seed, options.minutes, options.keep)
    counts = {area: Counter(verdict.kind for verdict in tried) for area, tried in verdicts.items()}
    for area, count in counts.items():
        print(f'{area:12} {count[ACCEPTED]:9} {count[REFUSED]:8} {count[FALLEN]:7}')
    sys.exit(1 if any(count[FALLEN] for count in counts.values()) else 0)


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--minutes', type=float, default=1.0, help='how long (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')
    parser.add_argument('--areas', nargs='+', choices=AREAS, default=list(AREAS), help='default: all')
    parser.add_argument('--case', type=int, metavar='N', help='run only the case N')
    parser.add_argument('--keep', type=Path, default=KEEP, metavar='DIR', help='of inputs that fell')
    return parser.parse_args()


if __name__ == '__main__':
    main()
