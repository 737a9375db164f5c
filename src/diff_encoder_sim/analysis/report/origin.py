"""Origin of the results: versions, commands, configuration, real encoders and robot of a campaign."""

from __future__ import annotations

import importlib.metadata
import platform
import shlex
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import yaml

from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.result_tables import ResultTable
from diff_encoder_sim.analysis.results_table import Results
from diff_encoder_sim.base.command_line import CONSOLE
from diff_encoder_sim.base.deferred import pandas as pd

# Libraries of the analysis; the manifest contains the versions of the campaign.
LIBRARIES = ('numpy', 'pandas', 'scipy', 'altair', 'vl-convert-python')

Facts = List[Tuple[str, str]]  # terms and their descriptions


def provenance(results: Results) -> Dict[str, Any]:
    """Return the commands that reproduce the results, facts, runs and the configuration as YAML."""
    manifest, runs, commands = results.manifest, results.manifest.get('runs', []), []
    own = {'python': platform.python_version(), **{name: importlib.metadata.version(name) for name in LIBRARIES}}
    facts: Facts = [('analysed with', _versions(own))]
    if 'fingerprint' in manifest:
        facts.append(('fingerprint of the configuration', str(manifest['fingerprint'])))
    if 'seeds' in manifest:
        facts.append(('seeds', ' to '.join(map(str, manifest['seeds'].values()))))
    if results.folder and runs:
        program, *arguments = map(str, runs[0].get('command') or [''])
        tool = [CONSOLE] if Path(program).name == CONSOLE else ['rosrun', 'diff_encoder_sim', 'campaign']
        commands = [shlex.join([*tool, *arguments]), shlex.join([*tool[:2], 'analyze', str(results.folder)])]
    configuration = manifest.get('configuration')
    return {
        'commands': commands,
        'facts': facts,
        'runs': [{'started': run.get('started', ''), 'facts': _facts_of_run(run)} for run in runs],
        'configuration': configuration and yaml.safe_dump(configuration, sort_keys=False),
    }


def _facts_of_run(run: Mapping[str, Any]) -> Facts:
    host, commit = run.get('machine') or {}, run.get('commit') or {}
    facts = [
        ('command', shlex.join(map(str, run.get('command', [])))),
        ('versions', _versions(run.get('versions') or {})),
    ]
    if commit:
        facts.append(('commit', f'{commit.get("id")}{" with changes" if commit.get("is_dirty") else ""}'))
    if host:
        memory_gib = int(host.get('memory_bytes') or 0) / 2**30
        cores = f'{host.get("usable_cores")} of {host.get("cores")} cores'
        facts.append(('host', f'{host.get("cpu")}, {cores}, {memory_gib:.0f} GiB, {host.get("os")}'))
    return facts


def _versions(versions: Mapping[str, Optional[str]]) -> str:
    return ', '.join(f'{name} {version}' for name, version in versions.items() if version)


def encoder_section(results: Results) -> Optional[ResultTable]:
    """Return the table of a campaign's real encoders; None if there are none."""
    rows = [
        [
            ppr_text(one['label']),
            *(one[name] for name in ('name', 'price', 'resolution')),
            f'{one["counts_per_metre"]:.1f}',
            '; '.join(map(str, one['source'])),
        ]
        for one in results.manifest.get('encoders') or ()
    ]
    heads = ('encoder', 'product', 'price', 'resolution', 'counts per metre', 'source')
    return _table('Real encoders', heads, rows)


def robot_section(results: Results) -> Optional[Dict[str, Any]]:
    """Return the section about a campaign's robot; None if the manifest contains no robot."""
    robot = results.manifest.get('robot')
    if not robot:
        return None
    checks = robot['checks']
    failed = [check['name'] for check in checks if not check['is_ok']]
    conclusion = f'It passed all {len(checks)} checks of its self-check.' if checks else 'It was not checked.'
    if failed:
        conclusion = f'Its self-check failed ({", ".join(failed)}): these results are not those of the real robot.'
    checked = [
        (check['name'], check['value'], 'ok' if check['is_ok'] else f'NOT OK: {check["advice"]}') for check in checks
    ]
    found = [(each['quantity'], each['value'], each['source']) for each in robot['found']]
    return {
        **{key: robot[key] for key in ('name', 'file', 'warnings', 'notes')},
        'conclusion': conclusion,
        'checks': _table('Self-check', ('check', 'value', 'result'), checked),
        'found': _table('Found', ('found', 'value', 'source'), found),
        'settings': _table('Set in its file', ('parameter', 'value'), list(robot['set'].items())),
    }


def _table(title: str, heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> Optional[ResultTable]:
    """Return a table of strings; None without rows."""
    texts = [list(map(str, row)) for row in rows]
    return ResultTable('', title, pd.DataFrame(texts, columns=list(heads))) if rows else None
