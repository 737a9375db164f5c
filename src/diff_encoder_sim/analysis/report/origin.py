"""The origin of the results: versions, commands and configuration; the real encoders and the robot of a campaign."""

from __future__ import annotations

import importlib.metadata
import platform
import shlex
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence

import yaml

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.table import Column, Entry, HtmlTable, Number, Table, html_table
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


_COLUMNS = [
    Column('encoder', 'encoder'),
    Column('name', 'as one buys it'),
    Column('price', 'price'),
    Column('resolution', 'resolution'),
    Column('counts_per_metre', 'counts per metre'),
    Column('source', 'source'),
]


def encoder_section(dataset: Dataset) -> Optional[HtmlTable]:
    """Return the table of a campaign's real encoders; None where it has none, and of bags."""
    encoders = (dataset.manifest or {}).get('encoders')
    if not isinstance(encoders, list):
        return None
    try:
        return html_table(Table('', 'Real encoders', _COLUMNS, [_row(encoder) for encoder in encoders], []))
    except (KeyError, TypeError, ValueError, AttributeError):  # a manifest that somebody has edited
        return None


def _row(encoder: Dict[str, Any]) -> List[Entry]:
    per_metre = Number(float(encoder['counts_per_metre']), 1)
    texts = [str(encoder[key]) for key in ('name', 'price', 'resolution')]
    return [ppr_text(str(encoder['label'])), *texts, per_metre, '; '.join(map(str, encoder['source']))]


class RobotSection(NamedTuple):
    """What the template shows of the robot."""

    name: str
    file: str
    conclusion: str
    checks: Optional[HtmlTable]  # None where none was made
    found: HtmlTable
    settings: Optional[HtmlTable]  # None where the robot file sets nothing
    warnings: List[str]
    notes: List[str]


def robot_section(dataset: Dataset) -> Optional[RobotSection]:
    """Return the section of a campaign's robot; None of bags, and of campaigns before robots had one."""
    robot = (dataset.manifest or {}).get('robot')
    if not isinstance(robot, dict):
        return None
    try:
        return _section(robot)
    except (KeyError, TypeError, AttributeError):  # a manifest that somebody has edited
        return None


def _section(robot: Dict[str, Any]) -> RobotSection:
    checks, settings = robot['checks'], robot['set']
    failed = [check['name'] for check in checks if not check['is_ok']]
    return RobotSection(
        str(robot['name']),
        str(robot['file']),
        _conclusion(len(checks), failed),
        _table('Self-check', ('check', 'value', 'result'), [_check_row(check) for check in checks]) if checks else None,
        _table('Found', ('found', 'value', 'source'), [_found_row(found) for found in robot['found']]),
        _table('Set in its file', ('parameter', 'value'), [[key, str(settings[key])] for key in settings])
        if settings
        else None,
        [str(warning) for warning in robot['warnings']],
        [str(note) for note in robot['notes']],
    )


def _conclusion(count: int, failed: List[str]) -> str:
    if not count:
        return 'It was not checked.'
    if failed:
        return f'Its self-check failed ({", ".join(failed)}): these results are not those of the real robot.'
    return f'It passed all {count} checks of its self-check.'


def _check_row(check: Dict[str, Any]) -> List[str]:
    return [str(check['name']), str(check['value']), 'ok' if check['is_ok'] else f'NOT OK: {check["advice"]}']


def _found_row(found: Dict[str, Any]) -> List[str]:
    return [str(found[key]) for key in ('quantity', 'value', 'source')]


def _table(title: str, heads: Sequence[str], rows: List[List[str]]) -> HtmlTable:
    return html_table(Table('', title, [Column(head, head) for head in heads], [list(row) for row in rows], []))
