"""Commands that run a module of this package in a separate process."""

from __future__ import annotations

import sys
from typing import List


def python_command(module: str) -> List[str]:
    """Return the command that runs `main` of a module below diff_encoder_sim with the sys.path of this process.

    `python -m` is no alternative: it imports from the current folder, which another user may own, before the libraries.
    """
    code = f'import sys; sys.path[:] = {sys.path!r}; from diff_encoder_sim.{module} import main; main()'
    return [sys.executable, '-c', code]
