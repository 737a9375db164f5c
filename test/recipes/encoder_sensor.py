from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

params = EncoderParams.from_mapping({'encoder': {'sensor': 'resolver', 'bits': 10}}, 'config')
chain = Chain(params)
chain.step(0, 0.0, 0.0)
sample = chain.step(50_000_000, 6.2831853072, -6.2831853)[-1].sample
assert sample[1:3] == (1024, -1024), sample
