"""The answer of advise at the start of a report, and the links between the pages of advise and analyze.

advise writes into the folder of results itself, or into advice/ in it; analyze writes into analysis/.
"""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Dict, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.report.about import Link
from diff_encoder_sim.analysis.results_table import Results
from diff_encoder_sim.base.command_line import as_typed
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.trials.trials_csv import MANIFEST

ADVICE, ANALYSIS = 'advice', 'analysis'  # folders
PAGE, NUMBERS, REPORT = 'advice.html', 'advice.json', 'report.html'


class FoundAnswer(NamedTuple):
    """Answer that advise has written."""

    page: Path
    robot: str
    requirement: str
    answers: Dict[str, str]  # texts by their heads
    assumptions: str


def find_answer(results: Results) -> Optional[FoundAnswer]:
    """Read the answer next to a campaign's results; None if there is none, or it is of an older version."""
    for folder in () if results.folder is None else (results.folder, results.folder / ADVICE):
        try:
            content = json.loads((folder / NUMBERS).read_text(encoding='utf-8'))
            texts, robot = content['summary'], str(content['robot']['name'])
            answers = {str(head): str(text) for head, text in texts['answers'].items()}
            return FoundAnswer(folder / PAGE, robot, str(texts['requirement']), answers, str(content['assumptions']))
        except (OSError, ValueError, LookupError, TypeError, AttributeError):
            continue
    return None


def advise_command(results: Results) -> str:
    """Return the command that writes the answer for a campaign's robot; '' for bags."""
    file = results.manifest.get('robot', {}).get('file', '')
    if results.folder is None or not file:
        return ''
    name = Path(file).stem if Path(file).parent == package_folder() / 'config' / 'robots' else file
    options = ['--robot', name, '--no-trials', '--out', str(results.folder / ADVICE)]
    return ' '.join([as_typed('advise'), *map(shlex.quote, options)])


def report_link(out: Path) -> Sequence[Link]:
    """Return a link from advise's page in `out` to the report of its trials or of the campaign that contains `out`.

    Without a report it names the command that writes it.
    """
    for folder in (out, *([out.parent] if out.name == ADVICE else [])):
        report = folder / ANALYSIS / REPORT
        if report.is_file() or (folder / MANIFEST).is_file():
            command = '' if report.is_file() else f'{as_typed("analyze")} {shlex.quote(str(folder))}'
            return [Link('Report of the trials', report, command)]
    return []
