"""A campaign: its parameters, cells and trials."""

from __future__ import annotations

import hashlib
import itertools
import json
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.nested_mappings import flat
from diff_encoder_sim.drives.bag_files import SUFFIXES
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_wheels import wheels_of
from diff_encoder_sim.trials.campaign_params import VARIANT, CampaignParams, Varied
from diff_encoder_sim.trials.campaign_robot import CampaignRobot
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.trial_files import TrialFiles
from diff_encoder_sim.wheels.chosen_encoder import ChosenEncoder
from diff_encoder_sim.wheels.pulses import PerWheel


class CampaignCell(NamedTuple):
    """One test with one encoder and one set of parameters; its trials differ by seed alone."""

    label: str  # in names of files; unique: SL_90_noise0.03
    test: TestDefinition
    encoder: ChosenEncoder
    varied: Varied
    robot_params: RobotParams  # resolved

    @property
    def ppr(self) -> PerWheel:
        """Return the encoder's counts per wheel revolution."""
        return self.encoder.ppr

    def varied_texts(self) -> Tuple[Tuple[str, str], ...]:
        """Return the varied parameters as a table shows them."""
        return tuple((key, text_of(value)) for key, value in self.varied)


class TrialJob(NamedTuple):
    """One trial of a campaign."""

    position: int  # in the order of the results, from 0
    cell_index: int
    trial: int  # from 1 in each cell
    seed: int


class Campaign(NamedTuple):
    """All that is needed to run the trials, on any host."""

    params: CampaignParams
    cells: List[CampaignCell]  # by test, then varied parameters, then encoder
    files: TrialFiles
    robot: Optional[CampaignRobot] = None

    @property
    def encoders(self) -> List[ChosenEncoder]:
        """Return the encoders, in the order of the results: those of each test and set of parameters."""
        first = self.cells[0]
        return [cell.encoder for cell in self.cells if (cell.test, cell.varied) == (first.test, first.varied)]

    def jobs(self) -> List[TrialJob]:
        """List every trial; equal trial numbers have equal seeds in all cells, and are compared in pairs."""
        numbers = itertools.product(range(len(self.cells)), range(1, self.params.trials + 1))
        return [
            TrialJob(position, cell_index, trial, self.params.seed + trial)
            for position, (cell_index, trial) in enumerate(numbers)
        ]

    def trial_of(self, job: TrialJob) -> Trial:
        """Return the job's trial as it is written into its bag."""
        cell = self.cells[job.cell_index]
        return Trial(
            test=cell.test,
            ppr=cell.ppr,
            number=job.seed,
            nav=self.params.nav,
            encoder=cell.encoder.name,
            resolution=cell.encoder.resolution,
            variant=dict(cell.varied).get(VARIANT, ''),
            **wheels_of(cell.robot_params.odometry, cell.robot_params.encoder),
        )

    def bag_name(self, job: TrialJob) -> str:
        """Name the file of the job's bag: SL_90_007.bag."""
        digits = max(3, len(str(self.params.trials)))
        return f'{self.cells[job.cell_index].label}_{job.trial:0{digits}d}{SUFFIXES[self.params.bag_format]}'

    def resolved(self) -> Dict[str, Any]:
        """Collect everything that determines the results, for JSON: all parameters, files by sha256."""
        params, encoders = self.params, self.encoders
        of_one_test = self.cells[: len(self.cells) // len(params.tests)]
        return {
            'tests': [self._dumped_test(cell.test) for cell in self.cells[:: len(of_one_test)]],
            'parameters': [_dumped_parameters(cell) for cell in of_one_test[:: len(encoders)]],
            'ppr': [ppr.model_dump(mode='json') for ppr in params.ppr],
            **({'encoders': _dumped_encoders(of_one_test, len(encoders))} if params.encoders else {}),
            'trials': params.trials,
            'seed': params.seed,
            'nav': params.nav,
            'record': params.record,
            # Left out of bags of ROS 1, so that campaigns from before there was a choice can be completed.
            **({} if params.bag_format == 'ros1' else {'bag_format': params.bag_format}),
            'robot': self.files.robot,
            'files': self.files.sha256(),
        }

    def fingerprint(self) -> str:
        """Compute the sha256 of `resolved`: campaigns of equal fingerprints have equal results."""
        text = json.dumps(self.resolved(), sort_keys=True, allow_nan=False)
        return hashlib.sha256(text.encode('utf-8')).hexdigest()

    def _dumped_test(self, test: TestDefinition) -> Dict[str, Any]:
        return {**test.model_dump(mode='json'), 'files': self.files.worlds[test.name]._asdict()}


def text_of(value: Any) -> str:
    """Return a parameter's value in one printable line."""
    is_plain = isinstance(value, str) and value.isprintable()
    return value if is_plain else json.dumps(value)


def _dumped_encoders(cells: Sequence[CampaignCell], count: int) -> List[Dict[str, Any]]:
    """Return each real one of `count` encoders with the parameters that it has otherwise than the first of all.

    Its `parameters` are by dotted keys, for each combination of varied parameters.
    """
    firsts = [dict(flat(_dumped_parameters(cell))) for cell in cells[::count]]
    return [
        {
            'label': cells[column].encoder.label,
            'parameters': [
                {key: value for key, value in flat(_dumped_parameters(cell)) if first.get(key) != value}
                for first, cell in zip(firsts, cells[column::count])
            ],
        }
        for column in range(count)
        if cells[column].encoder.real
    ]


def _dumped_parameters(cell: CampaignCell) -> Dict[str, Any]:
    parts = {name: part.model_dump(mode='json') for name, part in cell.robot_params._asdict().items()}
    return {'varied': dict(cell.varied), **parts}
