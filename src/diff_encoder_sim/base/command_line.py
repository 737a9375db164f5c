"""What all command-line tools share: the form of their help, and how they end on a user's mistake."""

from __future__ import annotations

import argparse
import sys
import textwrap
from typing import Callable, Sequence

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.version import package_version

HELP_WIDTH = 80


def tool_parser(name: str, description: str, examples: Sequence[str], notes: str = '') -> argparse.ArgumentParser:
    """Return a parser with --help and --version.

    Args:
        name: the executable, as after `rosrun diff_encoder_sim`.
        description: paragraphs, filled to the width of the help.
        examples: arguments of whole commands, without the executable.
        notes: paragraphs between the options and the examples.
    """
    commands = '\n'.join(f'  rosrun diff_encoder_sim {name} {arguments}'.rstrip() for arguments in examples)
    epilog = [*([_filled(notes)] if notes else []), f'examples:\n{commands}']
    parser = argparse.ArgumentParser(
        prog=name,
        description=_filled(description),
        epilog='\n\n'.join(epilog),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--version', action='version', version=f'%(prog)s (diff_encoder_sim) {package_version()}')
    return parser


def run_tool(name: str, tool: Callable[[], None]) -> None:
    """Run a tool; a user's mistake prints one line and exits with status 1."""
    try:
        tool()
    except ConfigError as error:
        sys.exit(f'{name}: {error}')
    except BrokenPipeError:
        # The reader (head, less) has closed the pipe: nothing more can be printed, and it is no error.
        sys.stderr.close()
        sys.exit(0)


def _filled(text: str) -> str:
    paragraphs = (' '.join(paragraph.split()) for paragraph in text.strip().split('\n\n'))
    return '\n\n'.join(textwrap.fill(paragraph, HELP_WIDTH) for paragraph in paragraphs)
