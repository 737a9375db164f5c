"""Folders: the package's own files, and the folder that the user's relative paths start from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Union

from diff_encoder_sim.base.errors import ConfigError


def package_folder() -> Path:
    """Return the folder of package.xml, config/, worlds/ and urdf/: the checkout, or where catkin or pip install them.

    Raises:
        ConfigError: neither is there.
    """
    here = Path(__file__).resolve()
    # Up from src/diff_encoder_sim of a checkout; catkin has share/ beside lib/python3/, pip in the package.
    for folder in here.parents:
        for candidate in (folder, folder / 'share' / 'diff_encoder_sim', folder / 'share'):
            if (candidate / 'config' / 'config.yaml').is_file():
                return candidate
    raise ConfigError(f'config/config.yaml: not found above {here}')


def users_path(given: Union[str, Path]) -> Path:
    """Resolve a path against the folder where the user typed roslaunch, which starts its processes in another one."""
    return (Path(os.environ.get('PWD', '.')) / given).resolve()
