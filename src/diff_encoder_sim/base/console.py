"""What the command-line tools share."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Callable, Union

from diff_encoder_sim.base.errors import ConfigError


def run_tool(name: str, tool: Callable[[], None]) -> None:
    """Run a tool; a user's mistake prints one line and exits with status 1."""
    try:
        tool()
    except ConfigError as error:
        sys.exit(f'{name}: {error}')
    except KeyboardInterrupt:
        print(f'{name}: stopped', file=sys.stderr)
        sys.exit(128 + signal.SIGINT)
    except BrokenPipeError:
        # The reader (head, less) has gone: nothing more to say, and nothing to say about it.
        sys.stderr.close()
        sys.exit(0)


def users_path(given: Union[str, Path]) -> Path:
    """A path as roslaunch's user means it: commands are started in another folder than theirs."""
    return (Path(os.environ.get('PWD', '.')) / given).resolve()
