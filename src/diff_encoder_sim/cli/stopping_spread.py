"""Before trials run: how much of the tolerances at a goal the robot's own way of stopping spends."""

from __future__ import annotations

import math
import sys

from diff_encoder_sim.base.command_line import as_called
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.stopping import as_upstream, spread_with, stopping_line


def name_stopping(name: str, campaign: Campaign, tolerance_m: float, tolerance_deg: float) -> None:
    """Print how the robot of a campaign stops, and a warning where that alone is more than the tolerance.

    Args:
        name: of the command.
        campaign: whose trials come.
        tolerance_m: what results are judged by, in x and in y.
        tolerance_deg: the same for the heading.
    """
    if campaign.params.nav != 'embedded':
        return
    pprs = [encoder.ppr for encoder in campaign.encoders]
    lines = [stopping_line(cell.robot_params, pprs) for cell in campaign.cells]
    finest = max(pprs, key=lambda ppr: min(ppr.left, ppr.right))
    spreads = [spread_with(cell.robot_params, finest) for cell in campaign.cells]
    most_m = max(spread.position_m for spread in spreads)
    most_deg = math.degrees(max(spread.yaw_rad for spread in spreads))
    if most_m > tolerance_m or most_deg > tolerance_deg:
        lines.append(
            f'stopping alone may end {1e3 * most_m:.0f} mm and {most_deg:.1f} degrees from a goal, whatever the '
            f'encoder; results are judged by {1e3 * tolerance_m:g} mm and {tolerance_deg:g} degrees; in the robot file '
            'set navigation.DWAPlannerROS.stop: precise, or a smaller xy_goal_tolerance or yaw_goal_tolerance'
        )
    for line in dict.fromkeys(lines):
        print(f'{as_called(name)}: {line}', file=sys.stderr)


def name_stopping_of_trial(nav: str, params: RobotParams) -> None:
    """Print how the robot of a live trial stops, if it is navigated."""
    if nav != 'scripted':
        used = as_upstream(params) if nav == 'upstream' else params
        print(f'trial.launch: {stopping_line(used, [params.encoder.counts_per_turn])}', file=sys.stderr)
