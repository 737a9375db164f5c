"""Files and version of the package, and the base folder of a user's relative paths."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Optional, Union
from xml.etree import ElementTree

from diff_encoder_sim.base.errors import ConfigError


def package_folder() -> Path:
    """Return the folder of package.xml and config/: the checkout, catkin's or pip's; ConfigError if not found."""
    here = Path(__file__).resolve()
    # Up from src/diff_encoder_sim of a checkout; catkin has share/ next to lib/python3/, pip in the package.
    for folder in here.parents:
        for candidate in (folder, folder / 'share' / 'diff_encoder_sim', folder / 'share'):
            if (candidate / 'config' / 'config.yaml').is_file():
                return candidate
    raise ConfigError(f'config/config.yaml: not found above {here}')


def users_path(given: Union[str, Path]) -> Path:
    """Resolve a path against the folder in which the user started roslaunch."""
    return (Path(os.environ.get('PWD', '.')) / given).resolve()


def package_version(folder: Optional[Path] = None) -> str:
    """Return the version in the package.xml of a folder, by default of `package_folder`."""
    return ElementTree.parse(str((folder or package_folder()) / 'package.xml')).findtext('version', '').strip()
