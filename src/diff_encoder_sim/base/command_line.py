"""Common parts of command-line tools: format of the help, and exit on user errors."""

from __future__ import annotations

import argparse
import contextlib
import logging
import math
import os
import shlex
import signal
import sys
import textwrap
from typing import Any, Callable, Iterator, Sequence

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.errors import CampaignFault, ConfigError, in_one_line, readable
from diff_encoder_sim.base.package_files import package_version

CONSOLE = 'diff-encoder-sim'
HELP_WIDTH = 80


def as_called(name: str) -> str:
    """Return a command's name for messages: `map_bag`, or `diff-encoder-sim map-bag`."""
    return f'{CONSOLE} {name.replace("_", "-")}' if os.path.basename(sys.argv[0]) == CONSOLE else name


def as_typed(name: str) -> str:
    """Return the command line of a command without arguments."""
    called = as_called(name)
    return f'rosrun diff_encoder_sim {name}' if called == name else called


def command_line(name: str) -> str:
    """Return the command line of this process with its arguments; '' if another program, such as a notebook, runs."""
    program, *arguments = sys.argv
    if os.path.basename(program) not in (CONSOLE, name):
        return ''
    given = arguments[1:] if as_called(name) != name else arguments  # after the command of the console
    return ' '.join([as_typed(name), *map(shlex.quote, given)])


def number_within(bounds: Between, kind: Callable[[str], Any] = float) -> Callable[[str], Any]:
    """Return the type of an argument that is a number within bounds."""

    def parse(text: str) -> Any:
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not bounds.allows(value):
            raise argparse.ArgumentTypeError(
                f'given {text!r}; allowed: {"a whole number, " if kind is int else ""}{bounds}'
            )
        return value

    return parse


def tool_parser(name: str, description: str, examples: Sequence[str], notes: str = '') -> argparse.ArgumentParser:
    """Return a parser with --help and --version.

    Args:
        name: the executable, as after `rosrun diff_encoder_sim`; the description begins with it.
        description: paragraphs, filled to the width of the help.
        examples: arguments of whole commands, without the executable.
        notes: paragraphs between the options and the examples.
    """
    commands = '\n'.join(f'  {as_typed(name)} {arguments}'.rstrip() for arguments in examples)
    parser = argparse.ArgumentParser(
        prog=as_called(name),
        description=_filled(description.replace(name, as_called(name), 1)),
        epilog=f'{_filled(notes)}\n\nexamples:\n{commands}'.strip(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--version', action='version', version=f'%(prog)s (diff_encoder_sim) {package_version()}')
    return parser


def _filled(text: str) -> str:
    paragraphs = (' '.join(paragraph.split()) for paragraph in text.strip().split('\n\n'))
    return '\n\n'.join(textwrap.fill(paragraph, HELP_WIDTH) for paragraph in paragraphs)


@contextlib.contextmanager
def user_errors(name: str) -> Iterator[None]:
    """Exit with status 1 and one line if the body or the decorated function of a tool has a user error."""
    try:
        yield
    except ConfigError as error:
        sys.exit(f'{as_called(name)}: {error}')
    except BrokenPipeError:
        # The reader (head, less) has closed the pipe, which is not an error.
        sys.exit(0)
    except MemoryError:
        sys.exit(f'{as_called(name)}: not enough memory')
    except OSError as error:
        # An invalid path, a folder without permission, or a full disk.
        named = f'{error.filename}: ' if error.filename is not None else ''
        sys.exit(f'{as_called(name)}: {readable(named + (error.strerror or in_one_line(error)))}')


class Stopped(BaseException):
    """SIGINT or SIGTERM stopped the tool. Not an Exception, so that no handler treats it as an error."""

    when = 'before the first trial'


@contextlib.contextmanager
def faults_of_trials(name: str) -> Iterator[None]:
    """As `user_errors` for a tool that runs trials; a fault or a signal prints one line and sets the exit status.

    SIGINT and SIGTERM raise `Stopped`; a second signal ends the process at once.
    """

    def stop(number: int, _: object) -> None:
        for each in before:
            signal.signal(each, signal.SIG_DFL)
        raise Stopped(number)

    logging.basicConfig(format=f'{as_called(name)}: %(message)s')
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with user_errors(name):
            yield
    except CampaignFault as fault:
        sys.exit(f'{as_called(name)}: {fault}')
    except Stopped as stopped:
        print(f'{as_called(name)}: stopped {stopped.when}', file=sys.stderr)
        sys.exit(128 + stopped.args[0])
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
