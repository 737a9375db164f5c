"""The parameter /trial: what trial.launch tells its nodes about the run."""

from __future__ import annotations

from typing import Optional

import rospy

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.trial_definition import TrialPlan

PARAMETER = '/trial'


def trial_plan() -> Optional[TrialPlan]:
    """The plan of the running trial, or None outside of one.

    Raises:
        ConfigError: the parameter is set, but is no plan.
    """
    plan = rospy.get_param(PARAMETER, None)
    return None if plan is None else TrialPlan.from_mapping(plan, PARAMETER)


def required_trial_plan() -> TrialPlan:
    """The plan of the running trial.

    Raises:
        ConfigError: there is none, or it is bad.
    """
    plan = trial_plan()
    if plan is None:
        raise ConfigError(f'{PARAMETER}: missing; allowed: as trial.launch sets it')
    return plan
