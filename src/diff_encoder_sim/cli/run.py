"""What the command-line tools share."""
from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Callable

from diff_encoder_sim.errors import ConfigError


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


def package_folder() -> Path:
    """Where config/, worlds/ and urdf/ are: the checkout, or the installed share folder.

    Raises:
        ConfigError: neither is there.
    """
    here = Path(__file__).resolve()
    # src/diff_encoder_sim/cli in a checkout, lib/python3/dist-packages/... when installed.
    for folder in here.parents:
        for candidate in (folder, folder / 'share' / 'diff_encoder_sim'):
            if (candidate / 'config' / 'config.yaml').is_file():
                return candidate
    raise ConfigError(f'config/config.yaml: not found above {here}')
