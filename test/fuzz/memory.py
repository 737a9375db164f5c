"""Watches the memory of one process that runs trial after trial in lockstep and reencodes a bag after each.

    .venv/bin/python test/fuzz/memory.py --minutes 60

Prints the resident memory each twelfth of the time. The status is 1 where it grew between the second and the last
quarter of the trials by more than 5 MiB (medians; the first quarter loads and compiles).
"""

import argparse
import contextlib
import io
import itertools
import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# The package last: with the workspace sourced it comes through catkin.
sys.path += [str(ROOT / 'test' / 'support'), str(ROOT / 'src')]

from diff_encoder_sim.cli.reencode import main as reencode
from lockstep_trials import BEND, HALL, ended, lockstep
from reencoding_drives import drive, write_ros1

REPORTS = 12
ALLOWED_MIB = 5.0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--minutes', type=float, default=60.0, help='default: %(default)s')
    limit_s = 60.0 * parser.parse_args().minutes
    print('minutes   trials     MiB')
    began_s, used_mib, reported = time.monotonic(), [], 0
    with tempfile.TemporaryDirectory() as folder:
        bag = write_ros1(Path(folder) / 'drive.bag', drive())
        for number in itertools.count(1):
            run(number, bag)
            used_mib.append(resident_mib())
            spent_s = time.monotonic() - began_s
            if spent_s * REPORTS >= limit_s * (reported + 1):
                reported += 1
                print(f'{spent_s / 60.0:7.1f} {number:8} {used_mib[-1]:7.1f}', flush=True)
            if spent_s > limit_s:
                break
    sys.exit(verdict(used_mib))


def run(number, bag):
    """One trial, of every test and encoder in turn, and one reencoded bag."""
    ended(lockstep((HALL, BEND)[number % 2], (40, 90, 1024)[number % 3], number=number))
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory() as folder:
        reencode([str(bag), '--ppr', '40', '1024', '--out', folder])


def resident_mib():
    return int(Path('/proc/self/statm').read_text().split()[1]) * resource.getpagesize() / 2**20


def verdict(used_mib):
    """'' where the memory stays, else by how much it has grown."""
    quarter = len(used_mib) // 4
    if quarter == 0:
        return 'fewer than four trials: nothing can be said'
    grown_mib = statistics.median(used_mib[-quarter:]) - statistics.median(used_mib[quarter : 2 * quarter])
    print(f'{len(used_mib)} trials; grown by {grown_mib:.1f} MiB between the second and the last quarter of them')
    return f'more than {ALLOWED_MIB} MiB' if grown_mib > ALLOWED_MIB else 0


if __name__ == '__main__':
    main()
