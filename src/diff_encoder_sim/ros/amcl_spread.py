"""How far apart the particles are: a warning in the log, and amcl's status on /diagnostics."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.topics import DIAGNOSTICS
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.ros.conversions import stamp_from_ns
from diff_encoder_sim.ros.display_topic import DisplayTopic
from diff_encoder_sim.ros.node import log


class Spread(NamedTuple):
    """Standard deviations of an estimate, or limits of them."""

    x: float  # [m]
    y: float  # [m]
    yaw: float  # [rad]

    def exceeds(self, limits: Spread) -> bool:
        """Return whether one of them is above its limit."""
        return any(value > limit for value, limit in zip(self, limits))


class AmclSpread:
    """Compares each estimate with std_warn_level_*, as upstream's diagnostics."""

    def __init__(self, diagnostic_period_s: float) -> None:
        self._period_ns = diagnostic_period_s * NANOSECONDS_PER_SECOND
        self._diagnostics = DisplayTopic(DIAGNOSTICS, DiagnosticArray, queue_size=10)
        self.restart()

    def restart(self) -> None:
        """Start anew with localization: at the start the particles are far apart, which is no reason for a warning."""
        self._was_exceeded = True

    def warn(self, estimate: AmclEstimate, params: AmclParams) -> None:
        """Log a warning where the estimate begins to exceed a limit."""
        spread, limits = _spread(estimate), _limits(params)
        is_exceeded = spread.exceeds(limits)
        if is_exceeded and not self._was_exceeded:
            log.warning(
                'uncertain pose: standard deviations %.2f m (x), %.2f m (y), %.0f degrees; above std_warn_level_* '
                '(%.2f m, %.2f m, %.0f degrees)',
                *spread[:2],
                math.degrees(spread.yaw),
                *limits[:2],
                math.degrees(limits.yaw),
            )
        self._was_exceeded = is_exceeded

    def diagnose(self, estimate: AmclEstimate, params: AmclParams, now_ns: int) -> None:
        """Publish the status of the newest estimate, once a period and to subscribers."""
        if self._diagnostics.is_due(self._period_ns, now_ns):
            message = DiagnosticArray(status=[spread_status(_spread(estimate), _limits(params))])
            message.header.stamp = stamp_from_ns(now_ns)
            self._diagnostics.publish(message)


def spread_status(spread: Spread, limits: Spread) -> DiagnosticStatus:
    """Return the status that upstream's amcl has, with its name, words and keys."""
    is_exceeded = spread.exceeds(limits)
    values = {
        **{f'std_{name}': value for name, value in spread._asdict().items()},
        **{f'std_warn_level_{name}': value for name, value in limits._asdict().items()},
    }
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if is_exceeded else DiagnosticStatus.OK,
        name=f'{rospy.get_name().lstrip("/")}: Standard deviation',
        message='Too large' if is_exceeded else 'OK',
        hardware_id='None',
        values=[KeyValue(key, f'{value:g}') for key, value in values.items()],
    )


def _spread(estimate: AmclEstimate) -> Spread:
    return Spread(*np.sqrt(np.diag(estimate.covariance)).tolist())


def _limits(params: AmclParams) -> Spread:
    return Spread(params.std_warn_level_x, params.std_warn_level_y, params.std_warn_level_yaw)
