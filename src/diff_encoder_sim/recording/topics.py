"""The topics of a trial's bag."""
from __future__ import annotations

# Latched JSON texts: what the trial is, and how it ended. A bag without a result is torn.
TRIAL = '/trial'
TRIAL_RESULT = '/trial_result'

CLOCK = '/clock'
ODOM = '/odom'
WORLD_POSE = '/world_pose'
GLOBAL_POSE = '/global_pose'

RECORDED = (TRIAL, TRIAL_RESULT, CLOCK, '/joint_states', '/cmd_vel', '/encoder_pulse', ODOM,
            WORLD_POSE, GLOBAL_POSE, '/tf', '/tf_static')
