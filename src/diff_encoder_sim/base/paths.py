"""Where the package's own files are."""

from __future__ import annotations

from pathlib import Path

from diff_encoder_sim.base.errors import ConfigError


def package_folder() -> Path:
    """Where config/, worlds/ and urdf/ are: the checkout, or the installed share folder.

    Raises:
        ConfigError: neither is there.
    """
    here = Path(__file__).resolve()
    # src/diff_encoder_sim in a checkout, lib/python3/dist-packages/... when installed.
    for folder in here.parents:
        for candidate in (folder, folder / 'share' / 'diff_encoder_sim'):
            if (candidate / 'config' / 'config.yaml').is_file():
                return candidate
    raise ConfigError(f'config/config.yaml: not found above {here}')
