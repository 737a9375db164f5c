"""The version of this package, which is written in package.xml alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Optional
from xml.etree import ElementTree

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.paths import package_folder

if TYPE_CHECKING:
    from importlib import metadata
else:
    metadata = deferred('importlib.metadata')

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
