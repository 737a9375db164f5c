"""Runs each test/rostest/*.test with `rostest`, so that pytest is the one command for unit tests and rostests.

rostest's exit code alone is not trusted: a test node that dies early can look fine, so its result files must show
at least one test and no failure.
"""

import contextlib
import importlib.util
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROSTESTS = sorted((Path(__file__).parent / 'rostest').glob('*.test'))
DEFAULT_TIME_LIMIT = 60.0  # rostest's own, for a <test> without time-limit, in seconds
START_AND_STOP = 60.0  # master and nodes up and down, on a loaded machine
TAIL_LINES = 60


def why_not() -> str:
    """Why rostests cannot run here; empty when they can."""
    if importlib.util.find_spec('rospy') is None or shutil.which('rostest') is None:
        return 'ROS is not importable here: source .ws/devel/setup.bash, or run scripts/test.sh'
    if importlib.util.find_spec('diff_encoder_sim.msg') is None:
        return 'the workspace is not sourced: source .ws/devel/setup.bash, or run scripts/test.sh'
    return ''


@pytest.mark.rostest
@pytest.mark.timeout(0)  # run_rostest has its own limit, and cleans up after it
@pytest.mark.parametrize('path', ROSTESTS, ids=lambda path: path.stem)
def test_rostest(path, tmp_path):
    reason = why_not()
    if reason and os.environ.get('ROSTESTS_REQUIRED'):
        pytest.fail(reason)
    if reason:
        pytest.skip(reason)

    limit = time_limit(path)
    code, output = run_rostest(path, tmp_path, limit)

    problems = [] if code == 0 else [f'stopped after {limit:.0f} s' if code is None else f'rostest ended with {code}']
    problems += result_problems(tmp_path / 'test_results')
    if problems:
        tail = '\n'.join(output.splitlines()[-TAIL_LINES:])
        pytest.fail(f'{path.name}: {"; ".join(problems)}. The end of its output:\n{tail}', pytrace=False)


def time_limit(path: Path) -> float:
    """The sum of the time limits in a .test file: rostest runs its tests one after the other."""
    try:
        limits = [test.get('time-limit') for test in ElementTree.parse(str(path)).getroot().iter('test')]
    except ElementTree.ParseError:
        limits = []  # rostest says what is wrong
    return START_AND_STOP + sum(float(limit) if limit else DEFAULT_TIME_LIMIT for limit in limits)


def run_rostest(path: Path, home: Path, limit: float):
    """(exit code or None when it took too long, output). rostest starts its own master on a free port.

    Not with --text, which shows more but leaves no result files and an exit code that is "not accurate".
    """
    environment = dict(
        os.environ,
        ROS_IP='127.0.0.1',
        ROS_HOME=str(home),
        ROS_LOG_DIR=str(home / 'log'),
        ROS_TEST_RESULTS_DIR=str(home / 'test_results'),
        PYTHONUNBUFFERED='1',
    )
    environment.pop('ROS_HOSTNAME', None)
    log = home / 'rostest.out'
    with open(log, 'wb') as out:
        process = subprocess.Popen(
            ['rostest', str(path)],
            cwd=str(home),
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            code = process.wait(limit)
        except subprocess.TimeoutExpired:
            code = None
        finally:
            stop(process, home)
    return code, log.read_text(errors='replace')


def stop(process, home: Path):
    """Ends rostest and every process it started. roslaunch gives each node a session of its own, out of reach of a
    signal to the group, so they are told by the ROS_HOME that only they have."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)  # lets rostest shut its nodes down
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(15)
    for number in (signal.SIGTERM, signal.SIGKILL):
        left = processes_of(home)
        for pid in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)
        deadline = time.monotonic() + 3.0
        while processes_of(home) and time.monotonic() < deadline:
            process.poll()  # reaps it
            time.sleep(0.1)
    process.poll()


def processes_of(home: Path):
    marker = b'ROS_HOME=' + os.fsencode(str(home)) + b'\0'
    found = []
    for entry in Path('/proc').glob('[0-9]*/environ'):
        try:
            environment = entry.read_bytes()
        except OSError:  # ended meanwhile, or somebody else's
            continue
        if marker in environment:
            found.append(int(entry.parent.name))
    return found


def result_problems(results: Path):
    """What the result files say is wrong: rosunit-*.xml is from each <test>, rostest-*.xml from rostest itself."""
    ran, problems = 0, []
    for file in sorted(results.rglob('*.xml')):
        try:
            suites = list(ElementTree.parse(str(file)).getroot().iter('testsuite'))
        except ElementTree.ParseError as error:
            problems.append(f'{file.name} is not whole ({error})')
            continue
        tests = sum(int(suite.get('tests', 0)) for suite in suites)
        if file.name.startswith('rosunit-'):
            ran += tests
            problems += [] if tests else [f'no test in {file.name}']
        problems += [
            f'{suite.get(kind)} {kind} in {file.name}'
            for suite in suites
            for kind in ('failures', 'errors')
            if int(suite.get(kind, 0) or 0)
        ]
    return problems if ran else problems + ['no test ran']
