"""The package's own files and version, and the folder that a user's relative paths start from."""

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


DISTRIBUTION = 'diff_encoder_sim'


def package_version(folder: Optional[Path] = None) -> str:
    """Return the version in a folder's package.xml: that of `package_folder` unless another is given.

    Where there is no package.xml, as after an installation by pip, the distribution's metadata has the version.
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
