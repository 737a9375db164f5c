"""Fuzzes every area for some minutes, prints what was tried and what fell, and keeps the failing inputs.

    .venv/bin/python test/fuzz/all.py --minutes 60 --seed 7
    .venv/bin/python test/fuzz/all.py --areas worlds --seed 7 --case 123     one case again, in this process

The status is 1 if anything fell.
"""

import argparse
import itertools
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
KEEP = ROOT / 'results' / 'fuzz'
# The package last: with the workspace sourced it comes through catkin.
sys.path += [str(ROOT / 'test' / 'support'), str(ROOT / 'test'), str(ROOT / 'src')]

from rounds import AREAS, fuzz, try_again
from sandbox import ACCEPTED, FALLEN, REFUSED


def main():
    options = parse()
    areas = [area for area in AREAS if area.name in options.areas]
    if options.case is not None:
        for area in areas:
            print(area.name, *try_again(area, options.seed, options.case))
        return
    done = fuzz(areas, options.seed, options.cases, options.minutes, options.keep)
    print(f'{"area":12} {"tried":>7} {ACCEPTED:>9} {REFUSED:>8} {FALLEN:>7}')
    for name, progress in done.items():
        counts = progress.counts
        print(f'{name:12} {progress.tried:7} {counts[ACCEPTED]:9} {counts[REFUSED]:8} {counts[FALLEN]:7}')
    alike = {}
    for fallen in itertools.chain(*(progress.fallen for progress in done.values())):
        alike.setdefault((fallen.area, fallen.reason.splitlines()[0][:70]), []).append(fallen)
    for (area, _), cases in alike.items():
        first = cases[0]
        print(f'\n{len(cases)} of {area}, the first is case {first.index}, in {first.kept}:\n{first.reason.strip()}')
    sys.exit(1 if alike else 0)


def parse():
    names = [area.name for area in AREAS]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--minutes', type=float, default=1.0, help='how long (default: %(default)s)')
    parser.add_argument('--cases', type=int, help='of each area, instead of minutes')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')
    parser.add_argument(
        '--areas',
        nargs='+',
        choices=names,
        default=names,
        metavar='AREA',
        help=f'{", ".join(names)} (default: all of these)',
    )
    parser.add_argument('--case', type=int, metavar='N', help='run the case N alone')
    parser.add_argument(
        '--keep', type=Path, default=KEEP, metavar='DIR', help='of inputs that fell (default: %(default)s)'
    )
    return parser.parse_args()


if __name__ == '__main__':
    main()
