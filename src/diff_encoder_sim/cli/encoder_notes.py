"""What follows from the datasheets of encoders and from their rates, which is printed once."""

from __future__ import annotations

import sys
from typing import Iterable

from diff_encoder_sim.simulation.state import JOINTS_RATE_HZ
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.wheels.catalogue import ChosenEncoder


def name_encoders(command: str, encoders: Iterable[ChosenEncoder], wheel_diameter_m: float) -> None:
    """Print a line for each encoder with a resolution: what its counts follow from, and how many are on a metre."""
    for encoder in encoders:
        if encoder.resolution:
            name = f'{encoder.name} ({encoder.real.name})' if encoder.real else 'encoder'
            per_metre = f'{encoder.counts_per_metre(wheel_diameter_m):.5g} per metre'
            print(f'{command}: {name}: {encoder.resolution}, {per_metre}', file=sys.stderr)


def name_campaigns_encoders(command: str, campaign: Campaign) -> None:
    """Print what follows from the encoders and rates of a campaign."""
    name_encoders(command, campaign.encoders, campaign.cells[0].robot_params.odometry.wheel_diameter)
    name_rates(command, (cell.robot_params.encoder.rate for cell in campaign.cells))


def name_rates(command: str, rates_hz: Iterable[float]) -> None:
    """Print a line for each rate at which the simulator's encoders cannot report: they sample its joint states."""
    for rate_hz in dict.fromkeys(rates_hz):
        if rate_hz > JOINTS_RATE_HZ:
            given = f'rate: {rate_hz:g} Hz of reports'
            print(f'{command}: {given}, but joint states come at {JOINTS_RATE_HZ:g} Hz: so do reports', file=sys.stderr)
