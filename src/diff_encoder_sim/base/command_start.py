"""Start of every command. Imports little, as Ctrl-C before it prints a traceback."""

from __future__ import annotations

import atexit
import contextlib
import importlib
import os
import signal
import sys
from collections.abc import Iterator

STANDARD_ERROR = 2
OF_NODES = 'Launch files start it: topics and parameters are in docs/nodes.md.'
STOPPED = 128 + signal.SIGINT  # the exit status that shells expect after Ctrl-C


@contextlib.contextmanager
def printing(name: str) -> Iterator[None]:
    """End a command that cannot print or is out of memory; status 0 if the reader of a pipe has ended."""
    atexit.register(_write_rest)
    try:
        yield
    except BrokenPipeError:
        sys.exit(0)
    except OSError as error:
        sys.exit(f'{name}: {error.strerror}')
    except MemoryError:
        sys.exit(f'{name}: not enough memory')


def _write_rest() -> None:
    """Flush stdout and stderr; an error at exit would print a traceback."""
    for stream in filter(None, (sys.stdout, sys.stderr)):  # None after `command >&-`
        try:
            stream.flush()
        except ValueError:  # closed deliberately
            continue
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
            if not isinstance(error, BrokenPipeError):
                os.write(STANDARD_ERROR, f'the output cannot be written: {error.strerror}\n'.encode())
                os._exit(1)


def run_command(name: str, module: str, *arguments: object) -> None:
    """Import a command's module, such as `cli.campaign`, and run its `main`.

    Ctrl-C at any moment, also during the imports, prints one line and exits with status 130.

    Args:
        name: of the command, for the message.
        module: has `main`. That of a command has `parse`, which imports little, and may name the module `API` that
            `main` imports. Without `parse` it is a node, whose --help is the module's docstring. A function after a
            colon, `ros.maps:map_saver`, stands for `main` with its docstring, and `parse_map_saver` for `parse`.
        arguments: of `main`; the first is the command line, if it is not that of sys.argv.
    """
    line = f'{name}: stopped\n'.encode()

    def end_at_once(*_: object) -> None:
        # No cleanup is needed, and the imported module could catch or report an exception.
        os.write(STANDARD_ERROR, line)
        os._exit(STOPPED)

    signal.signal(signal.SIGINT, end_at_once)
    with printing(name):
        module, _, function = module.partition(':')
        imported = importlib.import_module(f'diff_encoder_sim.{module}')
        main = getattr(imported, function or 'main')
        parse = getattr(imported, f'parse_{function}' if function else 'parse', None)
        if parse is not None:
            # Parsed before the long imports, for --help and wrong arguments; `main` parses again.
            parse(*arguments[:1])
        elif {'-h', '--help'}.intersection(sys.argv[1:]):
            print(f'{((main if function else imported).__doc__ or name).strip()}\n\n{OF_NODES}')
            return
        if hasattr(imported, 'API'):
            importlib.import_module(f'diff_encoder_sim.{imported.API}')
    try:
        try:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            main(*arguments)
        finally:
            signal.signal(signal.SIGINT, end_at_once)
    except KeyboardInterrupt:
        os.write(STANDARD_ERROR, line)
        sys.exit(STOPPED)
