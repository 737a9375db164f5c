"""Types of numeric parameters, each with its unit and bounds.

The bounds cover robots of 1 mm to 100 m, and exclude values that overflow, never end or fill the memory. `0`, and
negative values if a name indicates it, have a special meaning (upstream's) or disable a feature.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from typing_extensions import Annotated

from diff_encoder_sim.base.deferred import deferred

if TYPE_CHECKING:
    import pydantic_core
    from pydantic import GetCoreSchemaHandler
else:
    pydantic_core = deferred('pydantic_core')  # which command lines, bounded too, do without


@dataclass(frozen=True)
class Between:
    """Bounds of a number, both included, for `Annotated`; with its unit, '' for none."""

    least: float
    most: float
    unit: str = ''
    or_zero: bool = False  # below `least`

    def __str__(self) -> str:
        bounds = f'{_short(self.least)} to {_short(self.most)}{f" [{self.unit}]" if self.unit else ""}'
        return f'0, or {bounds}' if self.or_zero else bounds

    def allows(self, number: float) -> bool:
        """Return whether a number, which may be NaN, is within the bounds."""
        return self.least <= number <= self.most or (self.or_zero and number == 0)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> pydantic_core.CoreSchema:
        """Check before the type: pydantic does not accept 10^400 as a number."""

        def check(value: Any) -> Any:
            if is_number(value) and not self.allows(value):
                raise pydantic_core.PydanticCustomError('out_of_bounds', '{allowed}', {'allowed': str(self)})
            return abs(value) if is_number(value) and value == 0 else value  # numpy rejects -0.0 as a scale

        return pydantic_core.core_schema.no_info_before_validator_function(check, handler(source))


def is_number(value: Any) -> bool:
    """Return whether a value is a number, not a bool."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _short(number: float) -> str:
    """Return 0.001 and 1e6, and whole numbers in full."""
    return str(number) if isinstance(number, int) else f'{number:.6g}'.replace('e+0', 'e').replace('e-0', 'e-')


# Parts of a robot and positions on it.
LENGTH = Between(1e-3, 100.0, 'm')
Length_m = Annotated[float, LENGTH]
LENGTH_OR_ZERO = Between(1e-3, 100.0, 'm', or_zero=True)
LengthOrZero_m = Annotated[float, LENGTH_OR_ZERO]
Offset_m = Annotated[float, Between(-100.0, 100.0, 'm')]

# The floor: positions, distances, cells of maps.
PLACES = Between(-1e6, 1e6, 'm')
Place_m = Annotated[float, PLACES]
Distance_m = Annotated[float, Between(0.0, 1e6, 'm')]
PositiveDistance_m = Annotated[float, Between(1e-6, 1e6, 'm')]
CellSide_m = Annotated[float, Between(1e-3, 100.0, 'm')]
Variance_m2 = Annotated[float, Between(0.0, 1e12, 'm^2')]
TravelVariance_m = Annotated[float, Between(0.0, 1.0, 'm^2/m')]

# Angles and turns: more than one turn counts.
ANGLES = Between(-1e4, 1e4, 'rad')
Angle_rad = Annotated[float, ANGLES]
Turn_rad = Annotated[float, Between(0.0, 1e4, 'rad')]
PositiveTurn_rad = Annotated[float, Between(1e-6, 1e4, 'rad')]
Turns = Annotated[float, Between(-1000.0, 1000.0, 'turns')]

PULSES_PER_TURN = Between(1e-3, 1e9, 'per revolution')
PulsesPerTurn = Annotated[float, PULSES_PER_TURN]
COUNTER_STATES = Between(2, 2**61, 'counts', or_zero=True)

# Motion.
Speed_mps = Annotated[float, Between(0.0, 100.0, 'm/s')]
PositiveSpeed_mps = Annotated[float, Between(1e-3, 100.0, 'm/s')]
Velocity_mps = Annotated[float, Between(-100.0, 100.0, 'm/s')]
PositiveAcceleration_mps2 = Annotated[float, Between(1e-3, 1e4, 'm/s^2')]
Acceleration_mps2 = Annotated[float, Between(-1e4, 1e4, 'm/s^2')]
TurnRate_radps = Annotated[float, Between(0.0, 1000.0, 'rad/s')]
PositiveTurnRate_radps = Annotated[float, Between(1e-3, 1000.0, 'rad/s')]
PositiveTurnAcceleration_radps2 = Annotated[float, Between(1e-3, 1e5, 'rad/s^2')]

# Time: 1e6 s are twelve days.
Duration_s = Annotated[float, Between(0.0, 1e6, 's')]
PositiveDuration_s = Annotated[float, Between(1e-3, 1e6, 's')]
SignedDuration_s = Annotated[float, Between(-1e6, 1e6, 's')]
Rate_Hz = Annotated[float, Between(1e-3, 1e6, 'Hz')]
RateOrZero_Hz = Annotated[float, Between(1e-3, 1e6, 'Hz', or_zero=True)]
SignedRate_Hz = Annotated[float, Between(-1e6, 1e6, 'Hz')]

# Without unit.
FRICTION = Between(1e-3, 1e6)  # coefficient; Gazebo's own ground plane has 100
Friction = Annotated[float, FRICTION]
Fraction = Annotated[float, Between(0.0, 1.0)]
Weight = Annotated[float, Between(0.0, 1e6)]
PositiveWeight = Annotated[float, Between(1e-6, 1e6)]
PERCENT = Between(0, 100, '%')
Percent = Annotated[int, PERCENT]
Count = Annotated[int, Between(1, 1_000_000)]
SEEDS = Between(0, 2**63 - 1)
Seed = Annotated[int, SEEDS]
TRIALS = Between(1, 1_000_000)  # of a campaign, and of each of its cells
