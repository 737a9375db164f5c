"""Runs each test/rostest/*.test with `rostest`, so that pytest is the one command for unit tests and rostests.

rostest's exit code is not sufficient: a test node that dies early can look fine, so its result files must show at least
one test and no failure.
"""

import contextlib
import signal
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from launched_graph import end_processes_of, require_ros, ros_environment

ROSTESTS = sorted((Path(__file__).parent / 'rostest').glob('*.test'))
LONG = ('conformance',)  # the documented commands judge the same nodes
START_AND_STOP_S = 60.0  # master and nodes up and down, on a loaded machine
TAIL_LINES = 60


@pytest.mark.rostest
@pytest.mark.timeout(0)  # it has its own limit, and cleans up after it
@pytest.mark.parametrize(
    'path',
    [pytest.param(path, marks=[pytest.mark.long] if path.stem in LONG else []) for path in ROSTESTS],
    ids=lambda path: path.stem,
)
def test_rostest(path, tmp_path):
    require_ros()
    limits = [float(test.get('time-limit')) for test in ElementTree.parse(str(path)).getroot().iter('test')]
    limit_s = START_AND_STOP_S + sum(limits)  # rostest runs its tests one after the other
    code, output = run_rostest(path, tmp_path, limit_s)
    problems = [] if code == 0 else [f'stopped after {limit_s:.0f} s' if code is None else f'rostest ended with {code}']
    problems += result_problems(tmp_path / 'test_results', len(limits))
    if problems:
        tail = '\n'.join(output.splitlines()[-TAIL_LINES:])
        pytest.fail(f'{path.name}: {"; ".join(problems)}. The end of its output:\n{tail}', pytrace=False)


def run_rostest(path, home, limit_s):
    """(exit code or None when it took too long, output). rostest starts its own master on a free port.

    Not with --text, which shows more but leaves no result files and an exit code that is "not accurate".
    """
    log = home / 'rostest.out'
    with open(log, 'wb') as out:
        process = subprocess.Popen(
            ['rostest', str(path)],
            cwd=str(home),
            env=ros_environment(home, ROS_TEST_RESULTS_DIR=str(home / 'test_results')),
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        code = None
        try:
            code = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)  # lets rostest shut its nodes down
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(15)
        finally:
            end_processes_of(home)
            process.poll()
    return code, log.read_text(errors='replace')


def result_problems(results, test_count):
    """What the result files report: rosunit-*.xml is from each <test>, rostest-*.xml from rostest itself."""
    ran, problems = 0, []
    for file in sorted(results.rglob('*.xml')):
        suites = list(ElementTree.parse(str(file)).getroot().iter('testsuite'))
        if file.name.startswith('rosunit-'):
            ran += any(int(suite.get('tests', 0)) for suite in suites)
        problems += [
            f'{suite.get(kind)} {kind} in {file.name}'
            for suite in suites
            for kind in ('failures', 'errors')
            if int(suite.get(kind, 0) or 0)
        ]
    return problems if ran == test_count else [*problems, f'{ran} of {test_count} tests ran']
