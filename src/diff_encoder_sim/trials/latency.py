"""How long the parts of the robot take, in a trial in lockstep."""

from __future__ import annotations

from pydantic import Field, field_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.simulation.state import TICK_NS, TICK_S

Latency_s = Annotated[float, Between(0.0, 10.0, 's')]


class LatencyParams(Params):
    """Simulated time from a part's input to the moment when its output reaches the others."""

    odometry: Latency_s = Field(0.0, description='from wheel angles to /odom [s]')
    localization: Latency_s = Field(0.0, description='from /odom and /scan to map->odom [s]')
    command: Latency_s = Field(0.02, description='from /odom to the wheels; 0.02 as in the live graph [s]')

    @field_validator('*')
    @classmethod
    def _check_ticks(cls, value: float) -> float:
        if abs(value / TICK_S - round(value / TICK_S)) > 1e-6:
            raise ValueError(f'whole {TICK_NS // 1_000_000} ms')
        return value


def latency_ns(latency_s: float) -> int:
    """Return a latency in nanoseconds."""
    return round(latency_s * NANOSECONDS_PER_SECOND)
