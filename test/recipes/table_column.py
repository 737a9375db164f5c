import pandas

from diff_encoder_sim import api

api.run_campaign('made', 'quick', tests=['SMT'], ppr=[90], trials=1, nav='scripted', workers=1)
[turns] = pandas.read_csv('made/trials.csv')['turns']
assert 3.0 < turns < 15.0, turns
