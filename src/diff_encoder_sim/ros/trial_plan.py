"""The parameter /trial, in which trial.launch gives the plan of the trial to its nodes."""

from __future__ import annotations

from typing import Optional

import rospy

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_rpc import from_xml_rpc
from diff_encoder_sim.drives.trial_definition import LivePlan

PARAMETER = '/trial'


def trial_plan() -> Optional[LivePlan]:
    """Return the plan of the running trial, None where there is no trial.

    Raises:
        ConfigError: the parameter is set, but is no plan.
    """
    plan = rospy.get_param(PARAMETER, None)
    return None if plan is None else LivePlan.from_mapping(from_xml_rpc(plan), PARAMETER)


def required_trial_plan() -> LivePlan:
    """Return the plan of the running trial.

    Raises:
        ConfigError: there is none, or it is no plan.
    """
    plan = trial_plan()
    if plan is None:
        raise ConfigError(
            f'{PARAMETER}: missing; expected the parameter that trial.launch sets: start this node by trial.launch'
        )
    return plan
