"""What a trial in lockstep is made from, and which trials are one drive of the robot."""

from __future__ import annotations

from typing import NamedTuple, Tuple

from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.trials.robot_params import RobotParams


class TrialSetup(NamedTuple):
    """A trial and the parameters of its robot."""

    plan: TrialPlan
    params: RobotParams

    def drive(self) -> Tuple[object, ...]:
        """Return what the robot's drive follows from; scripted trials for which it is equal are one drive."""
        plan, trial = self.plan, self.plan.trial
        return trial.test, trial.number, trial.nav, plan.world, plan.slam, trial.odom, *drive_params(self.params)


def drive_params(params: RobotParams) -> Tuple[object, ...]:
    """Return the parameters that change a scripted drive, or its messages but those of encoder and odometry."""
    frames = params.amcl.global_frame_id, params.odometry.odom_frame
    return params.simulator, params.latency.command, *frames
