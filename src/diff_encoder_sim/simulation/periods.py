"""Periods of the simulated robot's reports, live and in lockstep.

Other periods follow from parameters: the encoder's `rate`, the LiDAR's, and the navigator's `controller_frequency`.
"""

from __future__ import annotations

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# One step of simulated time: /clock and /joint_states.
TICK_NS = 10_000_000
TICK_S = TICK_NS / NANOSECONDS_PER_SECOND
JOINTS_RATE_HZ = 1.0 / TICK_S

# /gazebo/model_states, the true pose that is made from it, and the commands of the scripted drive.
STATES_PERIOD_NS = 50_000_000
STATES_PERIOD_S = STATES_PERIOD_NS / NANOSECONDS_PER_SECOND
STATES_RATE_HZ = 1.0 / STATES_PERIOD_S
