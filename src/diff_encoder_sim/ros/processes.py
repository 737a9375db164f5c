"""Replacing this process by another package's executable, with the name and remappings from roslaunch."""

from __future__ import annotations

import os
import sys
from typing import Sequence

import roslib.packages
import rospkg

from diff_encoder_sim.base.errors import ConfigError


def become(package: str, executable: str, arguments: Sequence[str], install_hint: str) -> None:
    """Replace this process by another package's executable, so that signals reach it directly.

    Raises:
        ConfigError: it is not installed; the text has `install_hint`.
    """
    try:
        found = roslib.packages.find_node(package, executable)
    except rospkg.ResourceNotFound:
        found = []
    if not found:
        raise ConfigError(f'{package} {executable} is not installed; {install_hint}')
    remappings = [argument for argument in sys.argv[1:] if ':=' in argument]
    os.execv(found[0], [found[0], *arguments, *remappings])
