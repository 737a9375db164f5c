"""The topics of a trial's bag."""
from __future__ import annotations

# Latched JSON texts: what the trial is, and how it ended. A bag without a result is torn.
TRIAL = '/trial'
TRIAL_RESULT = '/trial_result'

CLOCK = '/clock'
SCAN = '/scan'
ODOM = '/odom'
AMCL_POSE = '/amcl_pose'
GLOBAL_POSE = '/global_pose'
WORLD_POSE = '/world_pose'
TF_STATIC = '/tf_static'

# A trial without navigation leaves the last two lines silent.
RECORDED = (TRIAL, TRIAL_RESULT, CLOCK, '/joint_states', '/gazebo/model_states', '/cmd_vel',
            '/encoder_pulse', ODOM, GLOBAL_POSE, WORLD_POSE, '/tf', TF_STATIC, SCAN,
            AMCL_POSE, '/initialpose', '/map', '/map_metadata',
            '/move_base/goal', '/move_base/result')
