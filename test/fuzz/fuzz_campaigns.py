"""Results folders with torn, doubled and foreign rows, unknown columns, odd manifests and missing or damaged bags."""

import json
import shutil
from pathlib import Path
from unittest import mock

import numpy as np

from analysed_campaigns import finish
from campaign_files import RUN, small_campaign
from diff_encoder_sim.analysis.charts import figures
from diff_encoder_sim.analysis.outputs import output_folder, write_analysis
from diff_encoder_sim.analysis.report import page
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.analysis.terminal_summary import summary
from diff_encoder_sim.trials.results import ResultStore
from odd_values import ODD_VALUES, damaged, odd_mapping, pick

WRITTEN = 0.05  # fraction of the cases whose tables and report are written
_cache = {}


def warm_up(folder):
    """Make the good folder once: cases copy it."""
    _cache['campaign'] = small_campaign(folder)
    finish(_cache['campaign'], folder / 'good')
    _cache['files'] = {
        path.relative_to(folder / 'good'): path.read_bytes() for path in (folder / 'good').rglob('*') if path.is_file()
    }
    _analyze([folder / 'good'], None)


def run(rng, folder):
    results = folder / 'results'
    for path, content in _cache['files'].items():
        (results / path).parent.mkdir(parents=True, exist_ok=True)
        (results / path).write_bytes(content)
    for _ in range(int(rng.integers(1, 4))):
        pick(rng, (_change_table, _change_table, _change_manifest, _change_bags))(rng, results)
    if rng.random() < 0.5:
        with ResultStore(results, _cache['campaign'], RUN, bool(rng.integers(2))) as store:
            store.finish()
    paths = [results, results / 'bags', *sorted((results / 'bags').glob('*.bag'))[:2]]
    given = [results] if rng.random() < 0.6 else [pick(rng, paths) for _ in range(2)]
    _analyze(given, folder / 'analysis' if rng.random() < WRITTEN else None)


def _analyze(paths, out):
    results = load_results(paths)
    summary(results)
    if out:
        # V8, which draws, cannot start in a sandbox.
        without_figures = mock.patch.object(figures, 'write_figures', return_value=[])
        without_charts = mock.patch.object(page, 'trial_charts', return_value=None)
        with without_figures, without_charts, output_folder(out) as folder:
            write_analysis(results, folder)


def _change_table(rng, results):
    path = results / 'trials.csv'
    if not path.is_file():
        return
    lines = path.read_bytes().split(b'\n')
    row = int(rng.integers(len(lines)))
    fields = lines[row].split(b',')
    fields[int(rng.integers(len(fields)))] = str(pick(rng, ODD_VALUES)).encode('utf-8', 'replace')
    varied = [line.replace(b',', b',noise,' if index == 0 else b',0.03,', 2) for index, line in enumerate(lines)]
    lines = pick(
        rng,
        (
            [*lines[:row], lines[row][: int(rng.integers(len(lines[row]) + 1))]],  # torn
            [line + b',extra' if rng.random() < 0.9 else line for line in lines],
            [line.rpartition(b',')[0] for line in lines],
            [*lines, lines[row]],
            [lines[index] for index in rng.permutation(len(lines))],
            [*lines[:row], damaged(rng, lines[row]), *lines[row + 1 :]],
            [*lines[:row], b','.join(fields), *lines[row + 1 :]],
            varied,  # of a campaign that varied a parameter, instead of these or below
            lines + varied,
            *([], [b''], [b'\xff\xfe'], [lines[0]], lines[1:], [b'\xef\xbb\xbf' + lines[0], *lines[1:]]),
        ),
    )
    path.write_bytes(pick(rng, (b'\n', b'\n', b'\n', b'\r\n')).join(lines))


def _change_manifest(rng, results):
    path = results / 'manifest.json'
    action = rng.random()
    if not path.is_file() or action < 0.1:
        path.unlink(missing_ok=True)
    elif action < 0.3:
        path.write_bytes(damaged(rng, path.read_bytes()))
    else:
        path.write_text(json.dumps(odd_mapping(rng, json.loads(_cache['files'][Path('manifest.json')])), default=str))


def _change_bags(rng, results):
    bags = sorted((results / 'bags').glob('*.bag'))
    if not bags:
        return
    bag, action = pick(rng, bags), int(rng.integers(5))
    if action == 0:
        bag.unlink()
    elif action == 1:
        bag.write_bytes(damaged(rng, bag.read_bytes()))
    elif action == 2:
        shutil.copy(bag, bag.with_name('twice.bag'))
    elif action == 3:
        bag.rename(bag.with_name(pick(rng, ('ä.bag', 'SL_40_007.bag', 'x' * 200 + '.bag'))))
    else:
        shutil.rmtree(results / 'bags')
        (results / 'bags').write_bytes(np.random.default_rng(0).bytes(10))
