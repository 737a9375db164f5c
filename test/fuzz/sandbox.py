"""Runs one case in a process with limits, and judges how it ended.

A case may end in two ways: it is done, or it is refused by ONE line, with a status that is not 0. All else has fallen:
a traceback, a warning with a line of code, a signal, no end within the time, more memory than allowed.
"""

import faulthandler
import os
import resource
import signal
import sys
import traceback
import warnings
from pathlib import Path
from typing import Callable, Tuple

from diff_encoder_sim.base.errors import LONGEST_LINE, ConfigError, InputFault

ACCEPTED, REFUSED, FALLEN = 'accepted', 'refused', 'fallen'
OUTPUT, VERDICT = 'output.txt', 'verdict.txt'
MEMORY_BYTES = 1500 << 20  # beyond that of the caller
USAGE = 2  # argparse's status, after its usage and one line
COMPLAINTS = ('Traceback (most recent call last)', 'Warning:', 'Exception ignored')


def run_in_sandbox(run: Callable[[], None], folder: Path, cpu_s: int) -> Tuple[str, str]:
    """Run a case, and return how it ended, and why; what it prints is in `folder`/output.txt afterwards."""
    child = os.fork()
    if child == 0:
        try:
            _limit(cpu_s)
            _redirect(folder / OUTPUT)
            verdict = judge(run)
            sys.stdout.flush()
            sys.stderr.flush()
            (folder / VERDICT).write_text('\n'.join(verdict), errors='replace')
        finally:
            os._exit(0)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status) or not (folder / VERDICT).exists():
        return FALLEN, f'killed by signal {os.WTERMSIG(status)}; no end within {cpu_s} s, if it is one of time'
    kind, reason = (folder / VERDICT).read_text(errors='replace').split('\n', 1)
    printed = (folder / OUTPUT).read_text(errors='replace').splitlines()
    complaint = next((line for line in printed if any(word in line for word in COMPLAINTS)), None)
    return (kind, reason) if kind == FALLEN or complaint is None else (FALLEN, f'prints {complaint}')


def judge(run: Callable[[], None]) -> Tuple[str, str]:
    """Run a case in this process."""
    try:
        run()
    except SystemExit as end:
        given = end.code
    except (ConfigError, InputFault) as error:
        given = str(error)
    except Exception as error:
        return FALLEN, f'{type(error).__name__}: {str(error)[:200]}\n{traceback.format_exc()}'
    else:
        given = 0
    if given in (None, 0):
        return ACCEPTED, ''
    if given == USAGE:
        return REFUSED, ''
    if isinstance(given, str) and given.isprintable() and len(given) <= LONGEST_LINE:
        return REFUSED, given
    return FALLEN, f'ends with {given!r}, not one printable line of at most {LONGEST_LINE} characters'


def _limit(cpu_s: int) -> None:
    mapped = int(Path('/proc/self/statm').read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + MEMORY_BYTES,) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.alarm(10 * cpu_s)  # others use the machine as well


def _redirect(path: Path) -> None:
    """Write all output to a file, with the warnings that a user sees, also below pytest, which collects them."""
    faulthandler.disable()  # pytest's, which would print into pytest's output
    output = os.open(str(path), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    sys.stdout, sys.stderr = os.fdopen(1, 'w', closefd=False), os.fdopen(2, 'w', closefd=False)
    warnings.resetwarnings()
    for hidden in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter('ignore', hidden)
    warnings.showwarning = lambda message, category, file, line, *_: sys.stderr.write(
        warnings.formatwarning(message, category, file, line)
    )
