"""manifest.json: whose results a folder holds, and what they were computed with."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.host_info import cpu_model, git, usable_cores
from diff_encoder_sim.base.version import package_version
from diff_encoder_sim.trials.campaign_definition import Campaign

# Those that a result can depend on, and those that run the trials.
LIBRARIES = ('numpy', 'numba', 'pybullet', 'rosbags', 'pydantic', 'xacro', 'dask', 'distributed')
ABSENT = '(absent)'


def manifest_of(campaign: Campaign, run: Dict[str, Any]) -> Dict[str, Any]:
    """Return the content of a new folder's manifest; `run` is from `describe_run`."""
    seed, trials = campaign.params.seed, campaign.params.trials
    return {
        'name': campaign.params.name,
        'fingerprint': campaign.fingerprint(),
        'seeds': {'first': seed + 1, 'last': seed + trials},
        'runs': [run],
        **({'robot': campaign.robot.as_json()} if campaign.robot else {}),
        **({'encoders': _encoders(campaign)} if campaign.params.encoders else {}),
        **({'config_files': dict(campaign.params.files)} if campaign.params.files else {}),
        'configuration': campaign.resolved(),
    }


def _encoders(campaign: Campaign) -> List[Dict[str, Any]]:
    """Return what is known of the real encoders, and what their counts follow from."""
    diameter_m = campaign.cells[0].robot_params.odometry.wheel_diameter
    return [
        {
            'label': encoder.label,
            'name': encoder.real.name,
            'source': list(encoder.real.source),
            'price': encoder.real.price,
            'resolution': encoder.resolution,
            'counts_per_metre': encoder.counts_per_metre(diameter_m),
        }
        for encoder in campaign.encoders
        if encoder.real
    ]


def describe_run(package_folder: Path, command: Sequence[str]) -> Dict[str, Any]:
    """Describe what this process computes with: versions, commit, host, command line and time."""
    return {
        'started': datetime.now(timezone.utc).isoformat(timespec='seconds'),
        'command': list(command),
        'versions': _versions(package_folder),
        'commit': _commit(package_folder),
        'machine': _host(),
    }


def read_manifest(path: Path) -> Dict[str, Any]:
    """Read a manifest back.

    Raises:
        ConfigError: it is not as it was written.
    """
    try:
        manifest = json.loads(path.read_text(encoding='utf-8'))
        if isinstance(manifest['runs'][0], dict) and isinstance(manifest['configuration'], dict):
            return {'fingerprint': '', **manifest}
    except (ValueError, LookupError, TypeError):
        pass
    raise ConfigError(f'{path}: not the manifest of a campaign; expected it as campaign wrote it')


def differences(old: Any, new: Any) -> List[str]:
    """List the keys in which two resolved configurations differ, each with both values, a line each."""
    there, here = dict(_flat(old, '')), dict(_flat(new, ''))
    return [
        f'{key}: {there.get(key, ABSENT)!r} there, {here.get(key, ABSENT)!r} here'
        for key in {**there, **here}
        if there.get(key, ABSENT) != here.get(key, ABSENT)
    ]


def _flat(value: Any, path: str) -> Iterator[Tuple[str, Any]]:
    """Yield single values by dotted paths."""
    if not isinstance(value, (dict, list)):
        yield path, value
        return
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, below in items:
        yield from _flat(below, f'{path}.{key}' if path else str(key))


def _versions(package_folder: Path) -> Dict[str, Optional[str]]:
    versions: Dict[str, Optional[str]] = {
        'diff_encoder_sim': package_version(package_folder),
        'python': platform.python_version(),
    }
    for library in LIBRARIES:
        try:
            versions[library] = importlib.metadata.version(library)
        except importlib.metadata.PackageNotFoundError:
            versions[library] = None
    return versions


def _commit(package_folder: Path) -> Optional[Dict[str, Any]]:
    """Return the checkout's commit; None where the package is installed, even within another checkout."""
    if git(package_folder, 'ls-files', '--error-unmatch', 'package.xml') is None:
        return None
    return {
        'id': git(package_folder, 'rev-parse', 'HEAD'),
        'is_dirty': git(package_folder, 'status', '--porcelain') != '',
    }


def _host() -> Dict[str, Any]:
    return {
        'host': platform.node(),
        'cpu': cpu_model(),
        'cores': os.cpu_count(),
        'usable_cores': usable_cores(),
        'memory_bytes': os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES'),
        'os': platform.platform(),
    }
