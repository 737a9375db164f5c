"""Files and version of the package, and the base folder of a user's relative paths."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Optional, Union
from xml.etree import ElementTree

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError

if TYPE_CHECKING:
    from importlib import metadata
else:
    metadata = deferred('importlib.metadata')


def package_folder() -> Path:
    """Return the folder of package.xml, config/, worlds/ and urdf/: the checkout, or the installation of catkin or pip.

    Raises:
        ConfigError: not found.
    """
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


DISTRIBUTION = 'diff_encoder_sim'


def package_version(folder: Optional[Path] = None) -> str:
    """Return the version in a folder's package.xml: that of `package_folder` unless another is given.

    Without a package.xml, as after installation by pip, the version is read from the distribution's metadata.
    """
    try:
        text = ElementTree.parse(str((folder or package_folder()) / 'package.xml')).findtext('version')
    except (ConfigError, OSError, ElementTree.ParseError):
        return _distribution_version()
    return text.strip() if text else _distribution_version()


def _distribution_version() -> str:
    try:
        return metadata.version(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        return 'unknown'
