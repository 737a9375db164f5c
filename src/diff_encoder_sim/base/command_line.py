"""Common parts of command-line tools: format of the help, and exit on user errors."""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import re
import signal
import sys
import textwrap
from typing import Any, Callable, Iterator, NoReturn, Sequence

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.errors import CampaignFault, ConfigError, in_one_line, readable
from diff_encoder_sim.base.package_files import package_version

CONSOLE = 'diff-encoder-sim'


def as_called(name: str) -> str:
    """Return a command's name for messages: `map_bag`, or `diff-encoder-sim map-bag`."""
    return f'{CONSOLE} {name.replace("_", "-")}' if _is_console() else name


def as_typed(name: str) -> str:
    """Return the command line of a command without arguments."""
    return as_called(name) if _is_console() else f'rosrun diff_encoder_sim {name}'


def _is_console() -> bool:
    return os.path.basename(sys.argv[0]) == CONSOLE


def number_within(bounds: Between) -> Callable[[str], float]:
    """Return the type of an argument that is a number within bounds."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float('nan')
        if not bounds.allows(value):
            raise argparse.ArgumentTypeError(f'given {text!r}; allowed: {bounds}')
        return value

    return parse


def whole_number_within(bounds: Between) -> Callable[[str], int]:
    """Return the type of an argument that is a whole number within bounds."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = None
        if value is None or not bounds.allows(value):
            raise argparse.ArgumentTypeError(f'given {text!r}; allowed: a whole number, {bounds}')
        return value

    return parse


HELP_WIDTH = 80


class ToolParser(argparse.ArgumentParser):
    """argparse's parser, for UTF-8 arguments, with errors of limited length."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse arguments; other file names cannot be printed or written to a bag."""
        given = sys.argv[1:] if args is None else list(args)
        for each in given:
            if re.search('[\ud800-\udfff]', each):
                self.error(f'given {each!r}; allowed: text in UTF-8')
        return super().parse_known_args(given, namespace)

    def error(self, message: str) -> NoReturn:
        """Print the usage and the error, and exit with status 2."""
        super().error(readable(message))


def tool_parser(name: str, description: str, examples: Sequence[str], notes: str = '') -> argparse.ArgumentParser:
    """Return a parser with --help and --version.

    Args:
        name: the executable, as after `rosrun diff_encoder_sim`; the description begins with it.
        description: paragraphs, filled to the width of the help.
        examples: arguments of whole commands, without the executable.
        notes: paragraphs between the options and the examples.
    """
    commands = '\n'.join(f'  {as_typed(name)} {arguments}'.rstrip() for arguments in examples)
    epilog = [*([_filled(notes)] if notes else []), f'examples:\n{commands}']
    parser = ToolParser(
        prog=as_called(name),
        description=_filled(description.replace(name, as_called(name), 1)),
        epilog='\n\n'.join(epilog),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_version(parser)
    return parser


def add_version(parser: argparse.ArgumentParser) -> None:
    """Add --version, the version of the package."""
    parser.add_argument('--version', action='version', version=f'%(prog)s (diff_encoder_sim) {package_version()}')


def run_tool(name: str, tool: Callable[[], None]) -> None:
    """Run a tool; a user error prints one line and exits with status 1."""
    try:
        tool()
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


STOPPING_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stopped(BaseException):
    """A signal stopped the tool. Not an Exception, so that no handler treats it as an error."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number
        self.when = 'before the first trial'


def run_trials_tool(name: str, tool: Callable[[], None]) -> None:
    """Run a tool that runs trials; a fault or a signal prints one line and sets the exit status."""
    logging.basicConfig(format=f'{as_called(name)}: %(message)s')
    try:
        with signals_raise():
            run_tool(name, tool)
    except CampaignFault as fault:
        sys.exit(f'{as_called(name)}: {fault}')
    except Stopped as stopped:
        print(f'{as_called(name)}: stopped {stopped.when}', file=sys.stderr)
        sys.exit(128 + stopped.number)


@contextlib.contextmanager
def signals_raise() -> Iterator[None]:
    """Let SIGINT and SIGTERM raise `Stopped`."""

    def stop(number: int, _: object) -> None:
        for each in STOPPING_SIGNALS:
            signal.signal(each, signal.SIG_DFL)  # a second signal ends the process at once
        raise Stopped(number)

    before = {number: signal.signal(number, stop) for number in STOPPING_SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _filled(text: str) -> str:
    paragraphs = (' '.join(paragraph.split()) for paragraph in text.strip().split('\n\n'))
    return '\n\n'.join(textwrap.fill(paragraph, HELP_WIDTH) for paragraph in paragraphs)
