"""The encoders that results are computed for, one beside the other: ideal ones by their PPR, and real ones."""

from __future__ import annotations

import math
from typing import Any, Dict, NamedTuple, Optional

from diff_encoder_sim.wheels.encoder_catalogue import CatalogueEncoder
from diff_encoder_sim.wheels.encoder_model import EncoderModel
from diff_encoder_sim.wheels.pulses import PerWheel, encoder_label
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# By which config.yaml or a robot file says how many counts there are, in place of ppr.
RESOLUTION_KEYS = ('config.encoder.lines', 'config.encoder.pole_pairs', 'config.encoder.bits')


class ChosenEncoder(NamedTuple):
    """One of the encoders that are compared."""

    ppr: PerWheel  # counts per wheel revolution
    resolution: str = ''  # how they follow from a datasheet; '' where they are given
    real: Optional[CatalogueEncoder] = None  # None for an ideal one, and for the robot's own

    @property
    def name(self) -> str:
        """Return the name of a real one; '' for others."""
        return self.real.stem if self.real else ''

    @property
    def label(self) -> str:
        """Return how tables and names of files call it: `90`, or `8192 amt102`."""
        return encoder_label(self.ppr, self.name)

    @property
    def overrides(self) -> Dict[str, Any]:
        """Return what it sets, by dotted keys such as `config.encoder.lines`."""
        ppr = {'config.ppr': self.ppr.model_dump()}
        return {**ppr, **self.real.overrides} if self.real else ppr

    def counts_per_metre(self, wheel_diameter_m: float) -> float:
        """Return the counts of the left wheel on a metre."""
        return self.ppr.left / (math.pi * wheel_diameter_m)


def chosen(real: CatalogueEncoder) -> ChosenEncoder:
    """Choose a real encoder."""
    return own_encoder(real.params)._replace(real=real)


def own_encoder(params: EncoderParams) -> ChosenEncoder:
    """Choose the encoder that is in these parameters."""
    return ChosenEncoder(params.counts_per_turn, resolution_text(params.encoder))


def resolution_text(model: EncoderModel) -> str:
    """Return how the counts follow from the datasheet: `12 lines x 4 x gear 34.014 = 1632.672 counts per wheel ...`.

    '' where the model leaves them to ppr.
    """
    counts, of_shaft = model.counts_per_wheel_turn, model.counts_per_shaft_turn
    if counts is None or of_shaft is None:
        return ''
    gear = f' x gear {model.gear_ratio:g}' if model.side == 'motor' else ''
    return f'{_shaft_text(model, of_shaft)}{gear} = {counts:.9g} counts per wheel revolution'


def _shaft_text(model: EncoderModel, counts: int) -> str:
    if model.pole_pairs:
        return f'{model.pole_pairs} pole pairs x {counts // model.pole_pairs}'
    if model.lines:
        return f'{model.lines} line{"s" if model.lines > 1 else ""} x {counts // model.lines}'
    return f'2^{model.bits}'
