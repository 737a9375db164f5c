"""Numbers of both wheels, which users write as one number if they are equal."""

from __future__ import annotations

from typing import Any, Dict, Tuple, Union

from pydantic import BeforeValidator, Field, PlainSerializer
from typing_extensions import Annotated

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.params import Params


class PerWheel(Params):
    """One positive number for each wheel."""

    left: bounds.PulsesPerTurn = Field(description='of the left wheel')
    right: bounds.PulsesPerTurn = Field(description='of the right wheel')

    @property
    def plain(self) -> Union[float, Dict[str, float]]:
        """Return the value as users write it: one number if both wheels are equal, integers without a point."""
        left, right = (int(each) if each == int(each) else each for each in (self.left, self.right))
        return left if left == right else {'left': left, 'right': right}


class WheelDiameter(PerWheel):
    """Diameters of the left and the right wheel [m]."""

    left: bounds.Length_m = Field(description='of the left wheel [m]')
    right: bounds.Length_m = Field(description='of the right wheel [m]')

    def __str__(self) -> str:
        """Return `0.2`, or `0.316 (left) and 0.317 (right)`."""
        return str(self.left) if self.left == self.right else f'{self.left} (left) and {self.right} (right)'

    @property
    def mean(self) -> float:
        """Return the mean of both diameters [m], by which the robot's distances scale."""
        return 0.5 * (self.left + self.right)

    @property
    def radii_m(self) -> Tuple[float, float]:
        """Return the radii of the left and the right wheel."""
        return 0.5 * self.left, 0.5 * self.right


class WheelDiameterOrZero(WheelDiameter):
    """Diameters of the left and the right wheel [m]; 0 means as described elsewhere."""

    left: bounds.LengthOrZero_m = Field(description='of the left wheel [m]')
    right: bounds.LengthOrZero_m = Field(description='of the right wheel [m]')


def one_or_both(allowed: bounds.Between) -> BeforeValidator:
    """Return a validator that takes a number within bounds for those of both wheels."""

    def mapping_of(value: Any) -> Any:
        if isinstance(value, (dict, PerWheel)):
            return value
        if bounds.is_number(value) and allowed.allows(value):
            return {'left': value, 'right': value}
        raise ValueError(f'{allowed}, or {{left: ..., right: ...}}')

    return BeforeValidator(mapping_of)


_AS_WRITTEN = PlainSerializer(lambda wheels: wheels.plain)
WheelDiameter_m = Annotated[WheelDiameter, one_or_both(bounds.LENGTH), _AS_WRITTEN]
WheelDiameterOrZero_m = Annotated[WheelDiameterOrZero, one_or_both(bounds.LENGTH_OR_ZERO), _AS_WRITTEN]
