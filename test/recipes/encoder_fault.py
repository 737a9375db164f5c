import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

params = EncoderParams.from_mapping({'ppr': 100, 'encoder': {'faults': {'deaf_for': 1.0}}}, 'config')
stamps_ns = np.arange(0, 2_000_000_001, 10_000_000)
angles_rad = np.outer(stamps_ns * 1e-9, [2 * np.pi, 2 * np.pi]) + 1e-6  # a turn per second
chain, reports = Chain(params), []
counts = chain.run(Drive(stamps_ns, angles_rad)).counts[0, -1]
for stamp_ns, (left_rad, right_rad) in zip(stamps_ns.tolist(), angles_rad.tolist()):
    reports = chain.step(stamp_ns, left_rad, right_rad) or reports
assert 99 <= counts[0] <= 101, counts
assert reports[-1].sample[1:3] == tuple(counts), reports
