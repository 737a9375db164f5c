"""The trials of advise: run with one candidate after the other, as the search asks for them."""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack
from types import TracebackType
from typing import List, Optional, Sequence, Tuple, Type

from diff_encoder_sim.analysis.campaign_dataset import data_of
from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.cli.trial_workers import stop_reports, unrun_text, workers
from diff_encoder_sim.trials.campaign_cells import VARIANT, Campaign, TrialJob
from diff_encoder_sim.trials.cluster import Workers
from diff_encoder_sim.trials.engine import run_campaign
from diff_encoder_sim.trials.progress import progress_on
from diff_encoder_sim.trials.results import ResultStore, describe_run
from diff_encoder_sim.trials.time_left import time_left
from diff_encoder_sim.trials.worker import RunTrials


class CandidateTrials:
    """Runs the trials of an encoder when they are asked for. A context."""

    def __init__(self, options: argparse.Namespace, campaign: Campaign, run: RunTrials) -> None:
        """Open the results folder.

        Args:
            options: of the command line.
            campaign: with all candidates.
            run: runs trials on a worker.

        Raises:
            ConfigError: the folder has other things in it or cannot be used.
        """
        self._options = options
        self._campaign = campaign
        self._run_trial = run
        self._workers: Optional[Workers] = None  # from the first trial on
        self._store = ResultStore(options.out, campaign, describe_run(package_folder(), sys.argv))
        self._opened = ExitStack()
        self._opened.enter_context(self._store)

    def __enter__(self) -> CandidateTrials:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        if kind is None:
            self._store.finish()
        self._opened.__exit__(kind, error, trace)

    def with_encoder(self, label: str, count: int, variant: str) -> List[TrialData]:
        """Return the first `count` trials of each test with an encoder; those without a result are run first.

        Args:
            label: of the encoder.
            count: of trials.
            variant: name of the set of parameters; '' where the campaign has none.
        """
        wanted = label, variant
        jobs = [job for job in self._store.pending() if job.trial <= count and self._cell(job) == wanted]
        if jobs:
            self._run(f'{ppr_text(label)}{variant and f", {variant}"}', jobs)
        trials = [data_of(row) for row in self._store.rows if row.ppr == label and row.trial <= count]
        return [trial for trial in trials if dict(trial.varied).get(VARIANT, '') == variant]

    def _run(self, text: str, jobs: Sequence[TrialJob]) -> None:
        print(text, file=sys.stderr)
        if self._workers is None:
            self._workers = self._opened.enter_context(workers(self._options, len(jobs)))
        progress = progress_on(sys.stderr, len(jobs), [], time_left(self._campaign, jobs, self._store.rows))
        with progress, stop_reports(progress):
            unrun = run_campaign(self._workers, self._campaign, self._store, progress, jobs, self._run_trial)
        if unrun:
            sys.exit(unrun_text('advise', self._campaign, unrun))

    def _cell(self, job: TrialJob) -> Tuple[str, str]:
        cell = self._campaign.cells[job.cell_index]
        return cell.encoder.label, dict(cell.varied).get(VARIANT, '')
