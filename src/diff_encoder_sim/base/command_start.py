"""How every command starts. It imports next to nothing: what comes before it cannot be stopped in one line."""

from __future__ import annotations

import importlib
import os
import signal
import sys

STANDARD_ERROR = 2
HELP = frozenset(('-h', '--help'))
OF_NODES = 'Launch files start it: topics and parameters are in docs/nodes.md.'
STOPPED = 128 + signal.SIGINT  # the exit status that shells expect after Ctrl-C


def run_command(name: str, module: str, *arguments: object, parser: str = '') -> None:
    """Import a command's module, such as `cli.campaign`, and run its `main`.

    Ctrl-C at any moment, also during the imports, prints one line and exits with status 130.

    Args:
        name: of the command, for that line.
        module: has `main`.
        arguments: of `main`; the first is the command line, where it is not that of sys.argv.
        parser: the module of a command line's `parse`, which imports little; '' for a node, whose --help is the
            module's docstring.
    """
    line = f'{name}: stopped\n'.encode()

    def end_at_once(*_: object) -> None:
        # There is nothing to tidy up, and an exception could be swallowed, or reported, by what is being imported.
        os.write(STANDARD_ERROR, line)
        os._exit(STOPPED)

    signal.signal(signal.SIGINT, end_at_once)
    if parser:
        # `main` parses again, which costs nothing: here, --help and wrong arguments end before the long imports.
        importlib.import_module(f'diff_encoder_sim.{parser}').parse(*arguments[:1])
    imported = importlib.import_module(f'diff_encoder_sim.{module}')
    if not parser and HELP.intersection(sys.argv[1:]):
        print(f'{str(imported.__doc__).strip()}\n\n{OF_NODES}')
        return
    try:
        try:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            imported.main(*arguments)
        finally:
            signal.signal(signal.SIGINT, end_at_once)
    except KeyboardInterrupt:
        os.write(STANDARD_ERROR, line)
        sys.exit(STOPPED)
