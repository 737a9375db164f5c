"""Set-up of a lockstep trial, and its options."""

from __future__ import annotations

from typing import Literal, NamedTuple

from pydantic import Field

from diff_encoder_sim.base.params import Params
from diff_encoder_sim.drives.topics import BagFormat, RecordMode
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.trials.robot_params import RobotParams


class LockstepOptions(Params):
    """Keys of a campaign file that apply to each trial."""

    nav: Literal['embedded', 'scripted'] = Field('embedded', description='navigated, or a drive without feedback')
    record: RecordMode = Field('minimal', description='bags of all topics, without bulky ones such as /scan, or none')
    bag_format: BagFormat = Field('ros1', description='of the bags: ROS 1, or MCAP files of ROS 2')


class TrialSetup(NamedTuple):
    """A trial, the parameters of its robot, and its options."""

    plan: TrialPlan
    params: RobotParams
    options: LockstepOptions = LockstepOptions()
