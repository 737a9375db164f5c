from pathlib import Path

from diff_encoder_sim import api
from diff_encoder_sim.analysis.charts.figures import write_figures

results = api.run_campaign('made', 'quick', tests=['SMT'], ppr=[90], trials=1, nav='scripted', workers=1)

write_figures(results, Path('made/figures'))
assert '<svg' in Path('made/figures/durations.svg').read_text()
