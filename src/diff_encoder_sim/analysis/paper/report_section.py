"""The comparison of one or two datasets with the paper: tables for files and the report, and a few sentences."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.analysis.dataset import Dataset, TrialData, Varied, distinct
from diff_encoder_sim.analysis.paper.against_paper import all_cells_table, cell_tables, errata_table, resolution_table
from diff_encoder_sim.analysis.paper.claim_results import ClaimResult, check_claims
from diff_encoder_sim.analysis.paper.mean_table import mean_table
from diff_encoder_sim.analysis.paper.paper_cells import TRIALS
from diff_encoder_sim.analysis.paper.paper_comparison import PaperComparison, compare_with_paper
from diff_encoder_sim.analysis.paper.paper_setup import of_paper
from diff_encoder_sim.analysis.paper.score_tables import fit_texts, score_table, score_text
from diff_encoder_sim.analysis.paper.scores import Readings
from diff_encoder_sim.analysis.table import Table
from diff_encoder_sim.analysis.table_keys import varied_keys, varied_texts
from diff_encoder_sim.base.errors import ConfigError


class PaperSection(NamedTuple):
    """What is shown of the paper, beside each reading of it: a dataset, or a set of its varied parameters."""

    scores: Table
    texts: List[str]  # the scores in sentences, and which reading fits better
    claims: Dict[str, List[ClaimResult]]  # by reading
    cells: List[Table]
    all_cells: Table  # too long to show
    errata: Table
    has_enough_trials: bool  # as many as the paper has: with few, nearly everything agrees


def paper_section(datasets: Sequence[Dataset]) -> Optional[PaperSection]:
    """Compare datasets with the paper; None where there is but one and it has no cell of the paper, or another robot.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read, or one of several has no cell of the paper.
    """
    datasets = [of_paper(dataset) for dataset in datasets]
    comparisons = [compare_with_paper(dataset) for dataset in datasets]
    if len(datasets) == 1 and not comparisons[0].rows:
        return None
    for dataset, comparison in zip(datasets, comparisons):
        if not comparison.rows:
            raise ConfigError(
                f'{dataset.folder or dataset.title}: has no cell of the paper; '
                f"expected the paper's robot and tests (SL, SMT or DLD, navigated) with 40, 90, 1024 or 4096 PPR"
            )
    names = _names(datasets)
    readings = _readings(names, comparisons)
    return PaperSection(
        score_table(readings),
        [*(score_text(label, cells) for label, cells in readings.items()), *_fit_texts(names, datasets)],
        _claims(names, datasets, readings),
        [resolution_table(comparisons[0]), *cell_tables(readings), mean_table(dict(zip(names, datasets)))],
        all_cells_table(readings),
        errata_table(),
        all(one.trials >= TRIALS for cells in readings.values() for one in cells),
    )


def _readings(names: Sequence[str], comparisons: Sequence[PaperComparison]) -> Readings:
    """Return the compared cells of each reading."""
    return {
        _label(name, varied): [one for one in comparison.rows if one.cell.varied == varied]
        for name, comparison in zip(names, comparisons)
        for varied in distinct(one.cell.varied for one in comparison.rows)
    }


def _fit_texts(names: Sequence[str], datasets: Sequence[Dataset]) -> List[str]:
    """Say which reading fits better by the trials that all have: fewer trials contradict less."""
    common = set.intersection(*({_key(trial) for trial in dataset.trials} for dataset in datasets))
    equal = [
        dataset._replace(trials=[trial for trial in dataset.trials if _key(trial) in common]) for dataset in datasets
    ]
    return fit_texts(_readings(names, [compare_with_paper(dataset) for dataset in equal]))


def _key(trial: TrialData) -> Tuple[str, str, int]:
    return trial.test, trial.ppr, trial.trial


def _claims(names: Sequence[str], datasets: Sequence[Dataset], readings: Readings) -> Dict[str, List[ClaimResult]]:
    """Return the results of all claims by reading."""
    claims: Dict[str, List[ClaimResult]] = {label: [] for label in readings}
    for name, dataset in zip(names, datasets):
        for result in check_claims(dataset):
            claims.setdefault(_label(name, result.varied), []).append(result)
    return {label: claims[label] for label in readings}


def _names(datasets: Sequence[Dataset]) -> List[str]:
    """Return names that differ: the titles, or else the folders, or else numbers; none where parameters tell enough."""
    if len(datasets) == 1 and varied_keys(datasets[0]):
        return ['']
    titles = [dataset.title for dataset in datasets]
    folders = [str(dataset.folder) for dataset in datasets]
    numbers = [f'{title} ({number})' for number, title in enumerate(titles, start=1)]
    return next(names for names in (titles, folders, numbers) if len(set(names)) == len(names))


def _label(name: str, varied: Varied) -> str:
    return ', '.join(filter(None, [name, *varied_texts(varied)]))
