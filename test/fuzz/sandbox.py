"""Runs one case in a process of its own, with limits, and judges how it ended.

A case may end in two ways: it is done, or it is refused by ONE line, with a status that is not 0. All else has fallen:
a traceback, a warning with a line of code, a signal, no end within the time, more memory than allowed.
"""

import faulthandler
import os
import resource
import signal
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Callable, NamedTuple

from diff_encoder_sim.base.errors import ConfigError, InputFault

ACCEPTED, REFUSED, FALLEN = 'accepted', 'refused', 'fallen'
OUTPUT, VERDICT = 'output.txt', 'verdict.txt'
LONGEST_LINE = 3000  # characters, as in base/errors.py

# Of the caller, who waits for a machine that others use as well.
WALL_PER_CPU = 10
USAGE = 2  # argparse's status, after its usage and one line
POLL_S = 0.005
MEBIBYTE = 1 << 20


class Limits(NamedTuple):
    """What a case may use up."""

    cpu_s: int = 20
    memory_mib: int = 1500  # beyond that of the caller


class Verdict(NamedTuple):
    """How a case ended, and why."""

    kind: str
    reason: str


class Fault(Exception):
    """What came out is wrong, although nothing complained."""


def run_in_sandbox(run: Callable[[], None], folder: Path, limits: Limits) -> Verdict:
    """Run a case; what it prints is in `folder`/output.txt afterwards."""
    child = os.fork()
    if child == 0:
        _run_as_child(run, folder, limits)
    status, usage = _wait(child, limits.cpu_s * WALL_PER_CPU)
    if status is None:
        return Verdict(FALLEN, f'no end within {limits.cpu_s * WALL_PER_CPU} s')
    if os.WIFSIGNALED(status):
        return _of_signal(os.WTERMSIG(status), limits)
    used_mib = (usage.ru_maxrss - resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) // 1024
    if used_mib > limits.memory_mib:
        return Verdict(FALLEN, f'{used_mib} MiB of memory')
    kind, reason = (folder / VERDICT).read_text(errors='replace').split('\n', 1)
    if kind == FALLEN:
        return Verdict(kind, reason)
    return _of_output((folder / OUTPUT).read_text(errors='replace')) or Verdict(kind, reason)


def judge(run: Callable[[], None]) -> Verdict:
    """Run a case in this process."""
    try:
        run()
    except SystemExit as end:
        return Verdict(ACCEPTED, '') if end.code in (None, 0) else _of_line(end.code)
    except (ConfigError, InputFault) as error:
        return _of_line(str(error))
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        text = ' '.join(str(error).split())[:200]
        where = f'{Path(place.filename).name}:{place.lineno}'
        return Verdict(FALLEN, f'{type(error).__name__} at {where}: {text}\n{traceback.format_exc()}')
    return Verdict(ACCEPTED, '')


def _run_as_child(run: Callable[[], None], folder: Path, limits: Limits) -> None:
    """Run a case, leave its verdict in the folder, and end the process."""
    try:
        faulthandler.disable()  # pytest's, which would print into pytest's output
        os.setpgid(0, 0)
        _limit(limits)
        output = os.open(str(folder / OUTPUT), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        sys.stdout, sys.stderr = os.fdopen(1, 'w', closefd=False), os.fdopen(2, 'w', closefd=False)
        _print_warnings()
        verdict = judge(run)
        sys.stdout.flush()
        sys.stderr.flush()
        (folder / VERDICT).write_text(f'{verdict.kind}\n{verdict.reason}', errors='replace')
    except BaseException:
        (folder / VERDICT).write_text(f'{FALLEN}\nthe sandbox itself: {traceback.format_exc()}')
    finally:
        os._exit(0)


def _print_warnings() -> None:
    """Print those that a user sees, also below pytest, which collects them."""
    warnings.resetwarnings()
    for hidden in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter('ignore', hidden)
    warnings.showwarning = lambda message, category, file, line, *_: sys.stderr.write(
        warnings.formatwarning(message, category, file, line)
    )


def _limit(limits: Limits) -> None:
    mapped = int(Path('/proc/self/statm').read_text().split()[0]) * resource.getpagesize()
    most = mapped + limits.memory_mib * MEBIBYTE
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CPU, (limits.cpu_s, limits.cpu_s + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _wait(child: int, wall_s: float):
    """Return the status and the resource usage of a child, or None where it had to be killed."""
    deadline_s = time.monotonic() + wall_s
    while time.monotonic() < deadline_s:
        ended, status, usage = os.wait4(child, os.WNOHANG)
        if ended:
            return status, usage
        time.sleep(POLL_S)
    os.killpg(child, signal.SIGKILL)
    os.wait4(child, 0)
    return None, None


def _of_signal(number: int, limits: Limits) -> Verdict:
    if number in (signal.SIGXCPU, signal.SIGKILL):
        return Verdict(FALLEN, f'no end within {limits.cpu_s} s of processor time')
    return Verdict(FALLEN, f'killed by signal {number}')


def _of_line(given: object) -> Verdict:
    text = str(given)
    if given == USAGE:
        return Verdict(REFUSED, '')
    if not isinstance(given, str):
        return Verdict(FALLEN, f'ends with {given!r}, without a line')
    if len(text.splitlines()) != 1 or len(text) > LONGEST_LINE or not text.isprintable():
        return Verdict(FALLEN, f'the error is not one printable line of at most {LONGEST_LINE} characters: {text!r}')
    return Verdict(REFUSED, text)


def _of_output(text: str):
    for word in ('Traceback (most recent call last)', 'Warning:', 'Exception ignored'):
        line = next((line for line in text.splitlines() if word in line), None)
        if line is not None:
            return Verdict(FALLEN, f'prints {line}')
    return None
