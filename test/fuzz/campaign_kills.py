"""Kills campaigns and their workers at random moments, from the first import on, and compares what they leave.

    .venv/bin/python test/fuzz/campaign_kills.py --kills 100 --seed 1
    .venv/bin/python test/fuzz/campaign_kills.py --kills 100 --seed 1 --idle     trials that take no time

A killed campaign is started again until it is complete. Each process must end without a traceback, each client without
leaving a process, and trials.csv (but for wall times) and bags must equal those of an undisturbed campaign. The status
is 1 if anything else was seen. Ctrl-C before Python has come to the first line of a script is counted apart.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import psutil

ROOT = Path(__file__).resolve().parents[2]
# The package last: with the workspace sourced it comes through catkin.
sys.path += [str(ROOT / 'test' / 'support'), str(ROOT / 'test'), str(ROOT / 'src')]

import campaign_trials

from campaign_processes import results, workers_of

REAL, IDLE = ROOT / 'scripts' / 'campaign', ROOT / 'test' / 'campaign_trials.py'
ARGUMENTS = ['--config', 'quick', '--tests', 'SL', '--ppr', '40', '1024', '--trials', '3', '--workers', '2']
# What is killed, how, and how often of 100 times. SIGINT goes to the whole group, as from a terminal.
WAYS = {'client SIGKILL': 35, 'worker SIGKILL': 40, 'group SIGINT': 15, 'client SIGTERM': 10}
# The bare signal is seen of SIGTERM before the tool has its handlers, and of SIGINT when Python is through with it.
STATUS = {
    'client SIGKILL': (-signal.SIGKILL,),
    'group SIGINT': (128 + signal.SIGINT, -signal.SIGINT),
    'client SIGTERM': (128 + signal.SIGTERM, -signal.SIGTERM),
}
UNWANTED = ('Traceback', 'leaked', 'Error', 'Exception')
PATIENCE_S = 300.0


class KilledCampaigns:
    """Campaigns of one script that are killed by a seeded generator."""

    def __init__(self, script, folder, rng):
        self._script, self._folder, self._rng = script, folder, rng
        self._environment = {
            **os.environ,
            'PYTHONPATH': os.pathsep.join(filter(None, sys.path)),
            campaign_trials.FOLDER: str(folder),
        }
        self.seen = Counter()
        self.problems = []
        began_s = time.monotonic()
        process = self._start('undisturbed')
        while not workers_of(process):
            time.sleep(0.005)
        self.starts_s = time.monotonic() - began_s
        self._end(process, 'undisturbed', 0)
        self.lasts_s = time.monotonic() - began_s
        self._expected = results(folder / 'undisturbed')

    def run(self, kills):
        """Kill so many times; each folder is completed before the next is begun."""
        folder = 0
        while self._kills() < kills:
            self._complete(f'killed_{folder}', kills)
            folder += 1
        self.seen['results compared'] = folder

    def _kills(self):
        return sum(self.seen[way] for way in WAYS)

    def _complete(self, name, kills):
        process = self._start(name)
        while process.poll() is None and self._kills() < kills:
            process = self._kill(process, name)
        self._end(process, name, 0)
        if results(self._folder / name) != self._expected:
            self.problems.append(f'{name}: results differ')

    def _kill(self, process, name):
        """Wait for a random moment and kill; return the process that goes on."""
        way = self._rng.choice(list(WAYS), p=np.array(list(WAYS.values())) / sum(WAYS.values()))
        of_workers = way == 'worker SIGKILL'
        while of_workers and process.poll() is None and not workers_of(process):
            time.sleep(0.005)
        longest_s = self.lasts_s - self.starts_s if of_workers else self.lasts_s
        end_s = time.monotonic() + self._rng.uniform(0.0, longest_s)
        while time.monotonic() < end_s and process.poll() is None:
            time.sleep(0.005)
        workers = workers_of(process)
        if process.poll() is not None or (of_workers and not workers):
            return process
        if of_workers:
            self.seen[way] += 1
            workers[self._rng.integers(len(workers))].kill()
            return process
        self.seen[way] += 1
        children = psutil.Process(process.pid).children(recursive=True)
        if way == 'group SIGINT':
            os.killpg(process.pid, signal.SIGINT)
        else:
            process.send_signal(signal.SIGKILL if way == 'client SIGKILL' else signal.SIGTERM)
        self._end(process, f'{name} after {way}', *STATUS[way])
        left = psutil.wait_procs(children, timeout=20)[1]
        if left:
            self.problems.append(f'{name} after {way}: left {left}')
        return self._start(name)

    def _start(self, name):
        self.seen['campaigns started'] += 1
        self._said = self._folder / f'{self.seen["campaigns started"]}.log'
        with open(self._said, 'wb') as said:
            return subprocess.Popen(
                [sys.executable, str(self._script), *ARGUMENTS, '--out', str(self._folder / name)],
                env=self._environment,
                stdout=subprocess.DEVNULL,
                stderr=said,
                start_new_session=True,
            )

    def _end(self, process, name, *expected):
        """Wait for the end; note what it should not have said, and a status that was not expected."""
        status = process.wait(PATIENCE_S)
        said = self._said.read_text()
        self.seen['workers started again'] += said.count('trying again')
        if status == 1 and str(ROOT) not in said and 'KeyboardInterrupt' in said:
            self.seen['Ctrl-C before the first line of the script'] += 1
            return
        if -signal.SIGKILL in expected:
            said = said.replace('leaked semaphore', 'semaphore')  # which Python's resource tracker then removes
        # A campaign may be through before the signal arrives.
        if status not in (*expected, 0) or any(word in said for word in UNWANTED):
            self.problems.append(f'{name}: status {status}, expected {expected[0]}:\n{said}')


def main():
    options = parse()
    with tempfile.TemporaryDirectory() as folder:
        campaigns = KilledCampaigns(IDLE if options.idle else REAL, Path(folder), np.random.default_rng(options.seed))
        campaigns.run(options.kills)
    times = f'{campaigns.lasts_s:.1f} s, its workers began after {campaigns.starts_s:.1f} s'
    print(f'an undisturbed campaign of 6 trials took {times}; kills came at moments of these spans')
    for name, count in sorted(campaigns.seen.items()):
        print(f'{count:5} {name}')
    print('\n'.join(campaigns.problems) or 'no traceback, no process left, all results equal byte for byte')
    sys.exit(1 if campaigns.problems else 0)


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--kills', type=int, default=100, help='default: %(default)s')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')
    parser.add_argument('--idle', action='store_true', help='trials that do nothing, for more kills in less time')
    return parser.parse_args()


if __name__ == '__main__':
    main()
