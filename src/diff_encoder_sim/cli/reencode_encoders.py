"""The encoders of reencode: by --ppr and --encoder, or the robot's own."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import with_changes
from diff_encoder_sim.base.yaml_files import yaml_value
from diff_encoder_sim.cli.reencode_arguments import PAPER_PPR
from diff_encoder_sim.wheels.catalogue import ChosenEncoder, chosen, load_encoders, own_encoder
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


def given_encoders(options: argparse.Namespace) -> List[ChosenEncoder]:
    """Return the encoders of the command line in their order: none without options.

    Raises:
        ConfigError: one is bad, or given twice.
    """
    ideal = _ideal(options.ppr or ())
    real = [chosen(each) for each in load_encoders(options.encoder or (), package_folder() / 'config', Path())]
    for option, encoders in (('--ppr', ideal), ('--encoder', real)):
        labels = [encoder.label for encoder in encoders]
        twice = next((label for label in labels if labels.count(label) > 1), None)
        if twice is not None:
            raise ConfigError(f'{option}: given {twice} twice; allowed: each once')
    return [*ideal, *real]


def chosen_encoders(given: Sequence[ChosenEncoder], own: EncoderParams) -> List[ChosenEncoder]:
    """Return the given encoders; if there are none the robot's own, where it has a resolution, else the paper's.

    Raises:
        ConfigError: a PPR is given beside a resolution of the robot's own encoder.
    """
    resolution = own_encoder(own).resolution
    if not given:
        return [own_encoder(own)] if resolution else _ideal(PAPER_PPR)
    ideal = [encoder.label for encoder in given if encoder.real is None]
    if ideal and resolution:
        raise ConfigError(f'--ppr: given {" ".join(ideal)} beside encoder: {resolution}; allowed: one of them')
    return list(given)


def _ideal(texts: Sequence[str]) -> List[ChosenEncoder]:
    return [ChosenEncoder(ppr_of_text('--ppr', text)) for text in texts]


def ppr_of_text(option: str, text: str) -> PerWheel:
    """Read one PPR: a number, or a YAML mapping with one for each wheel.

    Raises:
        ConfigError: it is neither.
    """
    return EncoderParams.from_mapping({'ppr': yaml_value(text, option)}, option).ppr


def parameters_with(
    encoder: ChosenEncoder, of_robot: EncoderParams, odometry: OdometryParams
) -> Tuple[EncoderParams, OdometryParams]:
    """Return the parameters of a robot with another encoder.

    Raises:
        ConfigError: they contradict each other.
    """
    changes: Dict[str, Any] = {'ppr': encoder.ppr}
    if encoder.real:
        params = encoder.real.params
        changes.update({**params.model_dump(exclude_unset=True), 'encoder': params.encoder.model_dump()})
    shared = {key: value for key, value in changes.items() if key in OdometryParams.model_fields}
    source = f'encoder {encoder.label}'
    return with_changes(of_robot, changes, source), with_changes(odometry, shared, source)
