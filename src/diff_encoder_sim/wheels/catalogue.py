"""Commercial encoders, and the encoders chosen for a comparison."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence

from pydantic import Field, field_validator
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import Line, Params, did_you_mean, flat, load_params, missing, not_allowed
from diff_encoder_sim.base.per_wheel import PerWheel, WheelDiameter
from diff_encoder_sim.wheels.encoder_params import EncoderModel, encoder_label
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

WHOLE_CATALOGUE = 'catalogue'  # stands for every name

OF_ROBOT = 'included in the robot'  # price of an encoder that is not sold separately

# Keys of config.yaml that describe a device's controller.
OF_DEVICE = ('counter_modulus', 'rate', 'report', 'velocity_clock', 'velocity_method')


class EncoderFileParams(Params):
    """The keys of an encoder's file; config/encoders/ has patterns."""

    manufacturer: Line = Field(min_length=1, description='as on the datasheet')
    part: Line = Field(min_length=1, description='part number, with the resolution if there are several')
    type: Line = Field(min_length=1, description='principle and form, such as optical kit')
    mounting: Optional[Literal['motor', 'wheel', 'any', 'unknown']] = Field(
        None, description='shaft that it is mounted on; by default that of `encoder.side`'
    )
    link: Line = Field('', pattern='^(https://.*)?$', description='address of its documentation')
    source: List[Annotated[Line, Field(min_length=1)]] = Field(
        min_length=1, description='datasheets and manuals; comments call them [1], [2], ...'
    )
    price: Line = Field(min_length=1, description=f'class of its price, such as hobby, or {OF_ROBOT!r}')
    encoder: EncoderModel
    config: Dict[str, Any] = Field({}, description=f'other keys of config.yaml: {", ".join(OF_DEVICE)}')

    @property
    def name(self) -> str:
        """Return the name of the product."""
        return f'{self.manufacturer} {self.part}'

    @property
    def shaft(self) -> str:
        """Return the shaft that the encoder is mounted on."""
        return self.mounting or self.encoder.side

    @field_validator('encoder')
    @classmethod
    def _check_counts(cls, encoder: EncoderModel) -> EncoderModel:
        if encoder.counts_per_wheel_turn is None:
            raise missing({'hall': 'pole_pairs', 'absolute': 'bits'}.get(encoder.sensor, 'lines'))
        return encoder

    @field_validator('config')
    @classmethod
    def _check_keys(cls, config: Dict[str, Any]) -> Dict[str, Any]:
        for key, value in config.items():
            if key not in OF_DEVICE:
                raise not_allowed(key, value, f'the keys {", ".join(OF_DEVICE)}{did_you_mean(key, OF_DEVICE)}')
        return config


class ChosenEncoder(NamedTuple):
    """An encoder of a comparison."""

    ppr: PerWheel  # counts per wheel revolution
    params: Optional[EncoderParams] = None  # encoder model and controller parameters; None for an ideal encoder
    name: str = ''  # stem of the file of a commercial encoder, such as amt102
    real: Optional[EncoderFileParams] = None  # that file

    @property
    def label(self) -> str:
        """Return the label for tables and file names: `90`, or `8192 amt102`."""
        return encoder_label(self.ppr, self.name)

    @property
    def resolution(self) -> str:
        """Return the derivation of the counts from the datasheet; '' if ppr is given."""
        return resolution_text(self.params.encoder) if self.params else ''

    @property
    def overrides(self) -> Dict[str, Any]:
        """Return the overridden values by dotted keys such as `config.encoder.lines`, for `robot_params.override`.

        Every key of `encoder` is included, so the previous encoder is replaced completely.
        """
        values: Dict[str, Any] = {}
        if self.real and self.params:
            values = {**self.params.model_dump(exclude_unset=True), 'encoder': self.params.encoder.model_dump()}
        return {'config.ppr': self.ppr.model_dump(), **{f'config.{key}': value for key, value in flat(values)}}

    def counts_per_metre(self, diameter: WheelDiameter) -> float:
        """Return the counts of the left wheel per metre."""
        return self.ppr.left / (math.pi * diameter.left)


def encoder_names(config_folder: Path) -> List[str]:
    """Return the names of the encoders in config/encoders."""
    return sorted(path.stem for path in (config_folder / 'encoders').glob('*.yaml'))


def load_encoder(given: str, config_folder: Path, folder: Path) -> ChosenEncoder:
    """Load an encoder by name in encoders/ of `folder`, else by its path from there; ConfigError if missing or bad."""
    names, path = encoder_names(config_folder), folder / os.path.expanduser(given)
    if given in names:
        path = config_folder / 'encoders' / f'{given}.yaml'
    elif path.suffix != '.yaml' or not path.is_file():
        raise ConfigError(
            f'encoder: given {given!r}; allowed: {", ".join(names)}, {WHOLE_CATALOGUE} (all of these), '
            f'or an existing .yaml file{did_you_mean(given, names)}'
        )
    file = load_params(EncoderFileParams, path)
    try:
        params = EncoderParams.from_mapping({**file.config, 'encoder': file.encoder}, '')
    except ConfigError as error:
        raise ConfigError(f'{path}: config.{error}') from None
    return ChosenEncoder(params.counts_per_turn, params, path.stem, file)


def load_encoders(given: Sequence[str], config_folder: Path, folder: Path) -> List[ChosenEncoder]:
    """Load encoders as `load_encoder` does, with its errors; `catalogue` stands for all of config/encoders."""
    names = [name for each in given for name in (encoder_names(config_folder) if each == WHOLE_CATALOGUE else [each])]
    return [load_encoder(name, config_folder, folder) for name in names]


# Keys of config.yaml and robot files that set the resolution instead of ppr.
RESOLUTION_KEYS = ('config.encoder.lines', 'config.encoder.pole_pairs', 'config.encoder.bits')


def encoder_lines(encoders: Iterable[ChosenEncoder], diameter: WheelDiameter) -> Iterator[str]:
    """Yield the resolution by datasheet and the counts per metre of each encoder with a resolution."""
    for encoder in encoders:
        if encoder.resolution:
            name = f'{encoder.name} ({encoder.real.name})' if encoder.real else 'encoder'
            yield f'{name}: {encoder.resolution}, {encoder.counts_per_metre(diameter):.5g} per metre'


def own_encoder(params: EncoderParams) -> ChosenEncoder:
    """Choose the encoder of these parameters."""
    return ChosenEncoder(params.counts_per_turn, params)


def resolution_text(model: EncoderModel) -> str:
    """Return the derivation of the counts: `12 lines x 4 x gear 34 = 1632 counts ...`; '' if ppr sets them."""
    counts, of_shaft = model.counts_per_wheel_turn, model.counts_per_shaft_turn
    if counts is None or of_shaft is None:
        return ''
    shaft = f'2^{model.bits}'
    if model.pole_pairs:
        shaft = f'{model.pole_pairs} pole pairs x {of_shaft // model.pole_pairs}'
    elif model.lines:
        shaft = f'{model.lines} line{"s" if model.lines > 1 else ""} x {of_shaft // model.lines}'
    gear = f' x gear {model.gear_ratio:g}' if model.side == 'motor' else ''
    return f'{shaft}{gear} = {counts:.9g} counts per wheel turn'
