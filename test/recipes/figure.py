from pathlib import Path

from diff_encoder_sim import api

api.run_campaign('made', 'quick', tests=['SMT'], ppr=[90], trials=1, nav='scripted', workers=1)

api.write_report(api.read_results('made'), 'made/analysis')
assert '<svg' in Path('made/analysis/figures/durations.svg').read_text()
