"""How often a simulated robot reports, live and in lockstep.

What a user can set has its period elsewhere: the encoder's `rate`, the scanner's, the navigator's `controller_frequency`.
"""

from __future__ import annotations

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# One step of simulated time: /clock and /joint_states.
TICK_NS = 10_000_000
TICK_S = TICK_NS / NANOSECONDS_PER_SECOND

# Of /gazebo/model_states, of the true pose that is made from it, and of the scripted drive's commands.
STATES_PERIOD_NS = 50_000_000
STATES_PERIOD_S = STATES_PERIOD_NS / NANOSECONDS_PER_SECOND
STATES_RATE_HZ = 1.0 / STATES_PERIOD_S
