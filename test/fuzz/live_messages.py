"""Sends odd messages to the live nodes of a navigating robot, and prints what fell.

    source .ws/devel/setup.bash
    .venv/bin/python test/fuzz/live_messages.py --minutes 10 --seed 7

Bursts of up to 10,000 messages on the topics that nodes subscribe to, with NaN, stamps from everywhere, wrong lengths
and odd names, among the nodes' own; and steps of /clock. After each round every node must be there and respond, and
none may have printed a traceback. Where the robot goes meanwhile does not matter.
"""

import argparse
import re
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[1:1] = [str(ROOT / 'test' / 'support'), str(ROOT / 'test')]

from launched_graph import Graph

NODES = ROOT / 'test' / 'fuzz' / 'live_nodes.launch'
SENDER = ROOT / 'test' / 'fuzz' / 'live_sender.py'
NOT_OURS = '[robot_state_publisher'


def main():
    options = parse()
    deadline = time.monotonic() + 60.0 * options.minutes
    rounds, fallen, sent, seed = 0, [], 0, options.seed
    while (rounds < options.rounds) if options.rounds else (time.monotonic() < deadline):
        with tempfile.TemporaryDirectory() as folder, Graph(folder) as graph:
            launch = graph.launch(NODES)
            graph.wait_for_clock(1.0)
            while (rounds < options.rounds) if options.rounds else (time.monotonic() < deadline):
                code, output = graph.run(sys.executable, SENDER, seed)
                rounds, seed = rounds + 1, seed + 1
                sent += sum(int(count) for count in re.findall(r'^sent (\d+)', output, re.MULTILINE))
                print(f'seed {seed - 1}: {" ".join(output.split())}', flush=True)
                faults = faults_in(launch.output()) + ([output] if code else [])
                if faults:
                    fallen.append((seed - 1, faults))
                    break
    print(f'{rounds} rounds, {sent} messages, {len(fallen)} fallen')
    for seed, faults in fallen:
        print(f'--- seed {seed}', *faults, sep='\n')
    sys.exit(1 if fallen else 0)


def faults_in(output):
    """Tracebacks, and nodes of ours that ended by themselves."""
    ended = re.findall(r'(\[[\w-]+\] (?:has died|process has died).*)', output)
    died = [line for line in ended if not line.startswith(NOT_OURS)]
    found = re.search(r'^Traceback.*?(?=^\S.*?Error|\Z).*?$|^\[FATAL\].*?$', output, re.MULTILINE | re.DOTALL)
    return died + ([output[found.start() : found.start() + 3000]] if found else [])


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--minutes', type=float, default=1.0, help='how long (default: %(default)s)')
    parser.add_argument('--rounds', type=int, default=0, help='instead of minutes')
    parser.add_argument('--seed', type=int, default=0, help='of the first round (default: %(default)s)')
    return parser.parse_args()


if __name__ == '__main__':
    main()
