from pathlib import Path

from diff_encoder_sim import api

api.run_campaign('made', 'quick', tests=['square'], ppr=[90], trials=1, nav='scripted', workers=1)
assert 'square,90,' in Path('made/trials.csv').read_text()
