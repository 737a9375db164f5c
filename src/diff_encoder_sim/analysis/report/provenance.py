"""The origin of the results: versions, commit, host, configuration, and the commands that reproduce them."""

from __future__ import annotations

import importlib.metadata
import platform
import shlex
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional

import yaml

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.base.command_line import CONSOLE

# The analysis computes and draws with them; the campaign's own versions are in its manifest.
LIBRARIES = ('numpy', 'scipy', 'matplotlib')


class Fact(NamedTuple):
    """A term and its description."""

    term: str
    text: str


class Run(NamedTuple):
    """One start of a campaign; an interrupted campaign has several."""

    started: str
    facts: List[Fact]


class Provenance(NamedTuple):
    """The origin of a report."""

    commands: List[str]  # that reproduce the results; none for bags
    facts: List[Fact]
    runs: List[Run]
    configuration: Optional[str]  # YAML


def provenance(dataset: Dataset) -> Provenance:
    """Collect the origin from the campaign's manifest, where there is one."""
    manifest = dataset.manifest or {}
    facts = [Fact('analysed with', _versions(_own_versions()))]
    if 'fingerprint' in manifest:
        facts.append(Fact('fingerprint of the configuration', str(manifest['fingerprint'])))
    if isinstance(manifest.get('seeds'), dict):
        facts.append(Fact('seeds', ' to '.join(map(str, manifest['seeds'].values()))))
    runs = [run for run in manifest.get('runs', []) if isinstance(run, dict)]
    configuration = manifest.get('configuration')
    return Provenance(
        _commands(dataset, runs),
        facts,
        [_run(run) for run in runs],
        configuration and yaml.safe_dump(configuration, sort_keys=False),
    )


def _commands(dataset: Dataset, runs: List[Dict[str, Any]]) -> List[str]:
    if dataset.folder is None or not runs:
        return []
    program, *arguments = map(str, runs[0].get('command') or [''])
    folder = str(dataset.folder)
    if Path(program).name == CONSOLE:
        return [shlex.join([CONSOLE, *arguments]), shlex.join([CONSOLE, 'analyze', folder])]
    rosrun = ['rosrun', 'diff_encoder_sim']
    return [shlex.join([*rosrun, 'campaign', *arguments]), shlex.join([*rosrun, 'analyze', folder])]


def _run(run: Dict[str, Any]) -> Run:
    host, commit = run.get('machine') or {}, run.get('commit') or {}
    facts = [
        Fact('command', shlex.join(map(str, run.get('command', [])))),
        Fact('versions', _versions(run.get('versions') or {})),
    ]
    if commit:
        facts.append(Fact('commit', f'{commit.get("id")}{" with changes" if commit.get("is_dirty") else ""}'))
    if host:
        facts.append(Fact('host', _host(host)))
    return Run(str(run.get('started', '')), facts)


def _host(host: Dict[str, Any]) -> str:
    memory_gib = int(host.get('memory_bytes') or 0) / 2**30
    cores = f'{host.get("usable_cores")} of {host.get("cores")} cores'
    return f'{host.get("cpu")}, {cores}, {memory_gib:.0f} GiB, {host.get("os")}'


def _versions(versions: Dict[str, Optional[str]]) -> str:
    return ', '.join(f'{name} {version}' for name, version in versions.items() if version)


def _own_versions() -> Dict[str, Optional[str]]:
    return {
        'python': platform.python_version(),
        **{library: importlib.metadata.version(library) for library in LIBRARIES},
    }
