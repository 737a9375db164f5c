"""Judge each wrong node of test/support/wrong_odometry_node.py on a ROS graph: does it fail exactly its clause?

    source .ws/devel/setup.bash; .venv/bin/python test/benchmark/conformance_faults.py [FAULT...]

About 25 s for each of 39 nodes.
"""

import sys
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

import yaml

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / 'test' / 'support'))

from launched_graph import Graph  # noqa: E402
from odometry_subjects import COUNTS, FAULTS  # noqa: E402

NODE = '/wrong_odometry'
LIMIT_S = 300.0  # of a suite of 150 s, whose last cases take longer


def mapping(fault, inputs):
    """The content of a mapping file."""
    parameters = {'modulus': '{counter_modulus}', 'motion_noise': '{motion_noise}', 'reads_counts': inputs == COUNTS}
    return {
        'command': f'{sys.executable} {ROOT}/test/support/wrong_odometry_node.py "{fault}"',
        'input': inputs,
        'parameters': {NODE: parameters},
        'reset': f'{NODE}/reset',
        'counter_bits': [8, 16, 32],
        'sets_counter': True,
        'sets_noise': True,
    }


def failed_clauses(graph, folder, content):
    """The numbers of the clauses that a node fails."""
    (folder / 'node.yaml').write_text(yaml.safe_dump(content))
    arguments = '--node', folder / 'node.yaml', '--out', folder
    process = graph.start(sys.executable, ROOT / 'scripts' / 'conformance_node', *arguments)
    process.wait(LIMIT_S)
    cases = ElementTree.parse(str(folder / 'conformance.xml')).getroot().iter('testcase')
    return [case.get('name').split()[0] for case in cases if case.find('failure') is not None], process.output()


def main():
    """Print one line for each node."""
    chosen = {fault: FAULTS[fault] for fault in sys.argv[1:] or FAULTS}
    with tempfile.TemporaryDirectory() as name, Graph(name) as graph:
        graph.start_master()
        for fault, (clause, inputs) in chosen.items():
            begin_s = time.monotonic()
            found, output = failed_clauses(graph, Path(name), mapping(fault, inputs))
            verdict = 'exactly' if found == [clause] else f'WRONG\n{output}\n'
            print(f'{fault}: fails {", ".join(found)}: {verdict} ({time.monotonic() - begin_s:.0f} s)', flush=True)


if __name__ == '__main__':
    main()
