from pathlib import Path

from diff_encoder_sim.cli.campaign import main

cell = ['--config', 'quick', '--tests', 'SMT', '--ppr', '90', '--trials', '1', '--nav', 'scripted']
main([*cell, '--out', 'made', '--most-seconds', '5'])
assert 'timed_out,most_seconds,' in Path('made/trials.csv').read_text()
