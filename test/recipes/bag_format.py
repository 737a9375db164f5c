from pathlib import Path

from diff_encoder_sim import api

api.run_campaign('made', 'quick', tests=['SMT'], ppr=[90], trials=1, nav='scripted', workers=1, bag_format='sizes')

assert '/odom ' in Path('made/bags/SMT_90_001.txt').read_text()
