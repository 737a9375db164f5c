"""Uses the package with odd inputs, area by area, and prints what fell; inputs of what fell are kept.

    .venv/bin/python test/fuzz/all.py --minutes 60 --seed 7                 all areas
    .venv/bin/python test/fuzz/all.py --areas worlds --seed 7 --case 123    one case again, in this process

The status is 1 if anything fell.
"""

import argparse
import contextlib
import importlib
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

from diff_encoder_sim.base.command_line import user_errors
from sandbox import ACCEPTED, FALLEN, REFUSED, judge, run_in_sandbox

# Each makes an odd input from a generator in a folder, and uses it (`run`), and loads what every case needs before
# cases are forked (`warm_up`).
AREAS = ('encoders', 'lockstep', 'worlds', 'robots', 'maps', 'bags')
CPU_S = {'lockstep': 60, 'bags': 60}  # allowed for a case; usually 20


def warm_up(area):
    with tempfile.TemporaryDirectory(prefix='fuzz_') as folder, contextlib.redirect_stdout(io.StringIO()):
        importlib.import_module(f'fuzz_{area}').warm_up(Path(folder))


def case(area, seed, index, folder):
    """Return what runs a case: the same for the same seed, whatever else is tried."""
    rng = np.random.default_rng([seed, zlib.crc32(area.encode()), index])
    as_commands_do = user_errors('fuzz')
    return as_commands_do(lambda: importlib.import_module(f'fuzz_{area}').run(rng, folder))


def try_case(area, seed, index, keep):
    """Try one case in the sandbox and return the verdict; inputs of one that falls go below the folder `keep`."""
    with tempfile.TemporaryDirectory(prefix='fuzz_') as name:
        folder = Path(name)
        kind, reason = run_in_sandbox(case(area, seed, index, folder), folder, CPU_S.get(area, 20))
        if kind == FALLEN:
            shutil.copytree(folder, keep / f'{area}_{seed}_{index}', symlinks=True)
            print(f'\n{area} {index} fell: {reason.strip()}', flush=True)
    return kind, reason


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--minutes', type=float, default=1.0, help='how long (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')
    parser.add_argument('--areas', nargs='+', choices=AREAS, default=AREAS, help='default: all')
    parser.add_argument('--case', type=int, metavar='N', help='run only the case N')
    options = parser.parse_args()
    for area in options.areas:
        warm_up(area)
    if options.case is not None:
        for area in options.areas:
            folder = Path(tempfile.mkdtemp(prefix='fuzz_'))
            print(f'inputs: {folder}')
            print(area, *judge(case(area, options.seed, options.case, folder)))
        return
    # The minutes are shared among the areas.
    counts, spent_s = {area: Counter() for area in options.areas}, dict.fromkeys(options.areas, 0.0)
    end_s = time.monotonic() + 60.0 * options.minutes
    while time.monotonic() < end_s:
        area, began_s = min(options.areas, key=spent_s.get), time.monotonic()
        kind, _ = try_case(area, options.seed, sum(counts[area].values()), KEEP)
        counts[area][kind] += 1
        spent_s[area] += time.monotonic() - began_s
    for area, count in counts.items():
        print(area, *(f'{kind}: {count[kind]}' for kind in (ACCEPTED, REFUSED, FALLEN)))
    sys.exit(1 if any(count[FALLEN] for count in counts.values()) else 0)


if __name__ == '__main__':
    main()
