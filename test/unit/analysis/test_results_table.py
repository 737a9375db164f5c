"""Campaigns and bags as the table of results."""

import json
import math
import os
import shutil
import signal
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from campaign_files import RUN, row_of_trial, small_campaign
from diff_encoder_sim.analysis import results_table
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.analysis.results_table import encoders, first_of_cells, sample_text
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trial_run import run_group, run_trials
from diff_encoder_sim.trials.trials_csv import PARTS
from places import ROOT, SOURCE
from trial_bags import TRUTH, trial, write_bag
from trial_tables import ALTO, IN, cell, results_of
from trial_tables import trial as row

TOUR = str(ROOT / 'test' / 'rostest' / 'data' / 'short_tour.yaml')


def columns(results, *names):
    return list(results.trials[list(names)].itertuples(index=False, name=None))


def test_cells_are_in_the_papers_order_and_varied_parameters_are_not_pooled():
    trials = [row(test, ppr) for test in ('office', 'DLD', 'SL') for ppr in ('ideal', '1024', '40', '90-1024')]
    expected = [(test, ppr) for test in ('SL', 'DLD', 'office') for ppr in ('40', '1024', '90-1024', 'ideal')]
    assert columns(results_of(trials), 'test', 'ppr') == expected
    noisy = [row('SL', '90', number, noise=noise, variant='a') for noise in ('0.03', '0.01') for number in (2, 1)]
    found = columns(results_of(noisy, varied=['noise', 'variant']), 'setup', 'cell', 'trial')
    texts = [(f'noise {noise}, a', number) for noise in ('0.03', '0.01') for number in (1, 2)]
    assert found == [(f'SL, {text}', f'SL, 90 counts, {text}', number) for text, number in texts]


def test_of_many_each_cell_has_equally_many_and_one_at_least(monkeypatch):
    trials = results_of(cell('SL', '40', 'world', [IN] * 9), cell('SL', '90', 'world', [IN] * 2)).trials
    for most, counts in ((10, [5, 2]), (6, [3, 2]), (1, [1, 1])):
        monkeypatch.setattr(results_table, 'MOST_SHOWN', most)
        shown = first_of_cells(trials)
        assert list(shown['trial']) == [*range(1, counts[0] + 1), *range(1, counts[1] + 1)]
    assert sample_text(shown, trials) == 'The first 1 trials of each cell, of 11'


def finish(campaign, folder, count=None):
    """Run a campaign's trials: rows that are made up, and bags that are of the trials."""
    with ResultStore(folder, campaign, RUN) as store:
        for job in store.pending()[:count]:
            write_bag(folder / job.bag, job.definition())
            store.append(row_of_trial(job, job.bag))
        store.finish()
    return folder


@pytest.fixture(name='finished', scope='module')
def fixture_finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp('campaign')
    return finish(small_campaign(folder), folder / 'out')


@pytest.fixture(name='folder')
def fixture_folder(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / 'out')


def refusal(*paths):
    """The one line with which these paths are refused."""
    with pytest.raises(ConfigError, match=r'^[^\n]+$') as caught:
        load_results(paths)
    return str(caught.value)


def test_nothing_finished_and_other_paths_with_a_campaign_are_refused(folder, tmp_path):
    assert 'expected only this folder' in refusal(folder, tmp_path)
    assert refusal(folder.parent).startswith(f'{folder.parent}: contains the results of a campaign in {folder}')
    empty = finish(small_campaign(tmp_path), tmp_path / 'empty', 0)
    assert refusal(empty).startswith(f'{empty}: no trial is finished')
    (empty / 'trials.csv').unlink()
    assert refusal(empty).startswith(f'{empty}/trials.csv: cannot be read: No such file')


def test_a_campaign_is_its_table_and_the_paths_of_its_bags(finished):
    results = load_results([finished])
    assert (results.title, results.folder, results.robot, results.notes) == ('small', finished, ALTO, [])
    assert results.manifest == json.loads((finished / 'manifest.json').read_text())
    requested = {test: (load_test(test, ROOT / 'config'), 'embedded') for test in ('SL', 'SMT')}
    assert {test: (one.test, one.nav) for test, one in results.requested.items()} == requested
    expected = [(test, ppr, number) for test in ('SL', 'SMT') for ppr in ('40', '90') for number in (1, 2)]
    assert columns(results, 'test', 'ppr', 'trial') == expected and results.trials['seed'].tolist() == [1, 2] * 4
    second = results.trials.iloc[1]
    assert tuple(second[['odom_x_m', 'odom_y_m', 'odom_yaw_rad', 'duration_s']]) == (1 / 3, -1e-17, 0.0, 50.05)
    assert second['bag'] == str(finished / 'bags' / 'SL_40_002.bag') and len(second['true_path']) == 3
    assert second['odom_ate_rmse_m'] == pytest.approx(math.sqrt((0.3**2 + 0.1**2 + 0.4**2) / 3))
    assert math.isnan(second['amcl_ate_rmse_m']) and second['outcome'] == 'succeeded'


def test_a_campaign_that_goes_on_is_analysed_as_far_as_it_is(tmp_path, caplog):
    folder = finish(small_campaign(tmp_path), tmp_path / 'out', 3)
    with open(folder / 'trials.csv', 'ab') as table:
        table.write(b'SL,90,2,2,succ')
    results = load_results([folder])
    assert len(results.trials) == 3
    assert 'the last line is incomplete' in results.notes[0] and 'has 3 of 8 trials' in results.notes[1]
    assert [record.message for record in caplog.records] == results.notes


@pytest.mark.parametrize(
    ('name', 'change', 'where'),
    [
        ('manifest.json', lambda text: text[:-9], 'not the manifest of a campaign'),
        ('manifest.json', lambda text: '{"name": "x", "configuration": {"tests": []}}', 'not the manifest of a'),
        ('trials.csv', lambda text: text + text.splitlines()[-1] + '\n', 'line '),
        ('trials.csv', lambda text: text.replace('SL,', 'LS,', 1), 'line '),
        ('trials.csv', lambda text: text + 'SL,90\n', 'line '),
    ],
    ids=['torn', 'of something else', 'twice', 'another test', 'short'],
)
def test_a_file_that_is_none_of_a_campaign_is_named(folder, name, change, where):
    (folder / name).write_text(change((folder / name).read_text()))
    assert refusal(folder).startswith(f'{folder / name}: {where}')


def test_bags_that_do_not_fit_are_named_and_their_rows_stay(folder):
    bags = folder / 'bags'
    (bags / 'SL_40_001.bag').write_bytes(b'')
    shutil.copy(bags / 'SMT_90_001.bag', bags / 'SL_40_002.bag')
    (bags / 'SMT_90_002.bag').unlink()
    results = load_results([folder])
    assert (results.trials['bag'] == '').tolist() == 2 * [True] + 5 * [False] + [True]
    assert results.trials['true_path'].isna().tolist() == (results.trials['bag'] == '').tolist()
    assert 'has bags of 7 of 8 trials' in results.notes[0]
    assert f'{bags}/SL_40_001.bag: not a readable bag' in results.notes[1]
    assert results.notes[2].startswith(f'{bags}/SL_40_002.bag: differs')


def test_bags_of_both_formats_lead_to_the_same_table(tmp_path):
    found = []
    for bag_format in ('ros1', 'mcap'):
        (tmp_path / bag_format / 'scratch').mkdir(parents=True)
        out, changes = tmp_path / bag_format / 'out', {'nav': 'scripted', 'bag_format': bag_format}
        variants = {'a none': {}, 'missed 1 %': {'config.encoder.faults.missed': 0.01}}
        campaign = small_campaign(tmp_path, tests=[TOUR], ppr=[90], variants=variants, trials=1, **changes)
        with ResultStore(out, campaign, RUN) as store:
            files = campaign.files.materialise(tmp_path / bag_format / 'scratch')
            for requested in store.pending():
                ((finished, _),) = run_group(files, [requested], store.shared_folder(), run_trials)
                store.append(finished)
            store.finish()
        found += [load_results([out]), load_results([out / 'bags'])]
    names = [name for name in found[0].trials.columns if not name.endswith(('path', 'wall_time_s', 'bag'))]
    for results in found:
        assert results.varied == ['variant'] and results.trials['odom_ate_rmse_m'].notna().all()
        pd.testing.assert_frame_equal(results.trials[names], found[0].trials[names], check_exact=False, rtol=1e-12)
    assert found[0].notes == [] and columns(found[0], 'variant') == [('a none',), ('missed 1 %',)]
    pd.testing.assert_frame_equal(found[2].trials[names], found[0].trials[names], check_exact=True)


def test_only_good_bags_are_analysed_and_each_trial_and_definition_once(tmp_path, caplog):
    write_bag(tmp_path / 'a.bag', trial())
    shutil.copy(tmp_path / 'a.bag', tmp_path / 'b.bag')
    other = {**load_test('SL', ROOT / 'config').model_dump(), 'time_limit': 5.0}
    write_bag(tmp_path / 'c.bag', trial().model_copy(update={'test': type(trial().test).from_mapping(other, '')}))
    write_bag(tmp_path / 'nan.bag', trial(number=4), odom=[(math.nan, 0.0, 0.0)])
    write_bag(tmp_path / 'no_odom.bag', trial(number=2), odom=())
    write_bag(tmp_path / 'no_truth.bag', trial(number=3), truth=())
    write_bag(tmp_path / 'torn.bag', trial(number=5), result=None)
    results = load_results([tmp_path])
    assert list(results.trials['outcome']) == ['succeeded', 'torn']
    assert results.trials['odom_x_m'].isna().tolist() == [False, True]  # where a torn trial ended is unknown
    assert [record.message for record in caplog.records] == results.notes
    names = ['nan.bag', 'no_odom.bag', 'no_truth.bag', 'b.bag', 'c.bag']
    assert [note.split(':')[0].split('/')[-1] for note in results.notes] == names
    assert 'the same trial as ' in results.notes[3] and 'defines SL differently from ' in results.notes[4]


def test_bags_are_sorted_into_cells_and_other_configurations_and_real_encoders_are_kept_apart(tmp_path):
    for number in (2, 1):
        write_bag(tmp_path / f'{number}.bag', trial(ppr=4096, number=number))
    write_bag(tmp_path / 'ideal.bag', trial(odom='ideal'))
    amt102 = trial(ppr=8192, encoder='amt102', resolution='2048 lines x 4 = 8192 counts per wheel revolution')
    write_bag(tmp_path / 'amt102.bag', amt102)
    results = load_results([tmp_path])
    assert results.title == tmp_path.name and results.notes == [] and results.varied == []
    cells = [('4096', 1), ('4096', 2), ('8192 amt102', 1), ('ideal', 1)]
    assert columns(results, 'ppr', 'trial') == cells
    write_bag(tmp_path / 'z.bag', trial(ppr=8192, nav='embedded', variant='missed 1 %'))
    results = load_results([tmp_path])
    assert results.varied == ['nav', 'variant'] and encoders(results.trials)[1:3] == ['8192', '8192 amt102']
    assert set(columns(results, 'nav', 'variant')) == {('scripted', ''), ('embedded', 'missed 1 %')}
    assert results.notes[0].startswith(f'{tmp_path}/1.bag and others: nav is embedded or scripted')


def test_a_bag_has_all_that_its_row_would(tmp_path):
    path = write_bag(tmp_path / 'a.bag', trial(number=7), estimated=TRUTH[1:])
    results = load_results([path])
    assert (results.title, results.manifest, results.folder, results.robot) == ('a', {}, None, ALTO)
    [cells] = columns(results, 'test', 'ppr', 'trial', 'seed', 'outcome', 'bag')
    assert cells == ('SL', '40', 7, 7, 'succeeded', str(path))
    found = results.trials.iloc[0]
    assert found['duration_s'] == pytest.approx(0.1)
    assert found['distance_m'] == pytest.approx(10 + math.hypot(10, 0.1))
    assert [found[f'odom_{part}'] for part in PARTS] == pytest.approx([-0.1, 0.5, 0.05])  # from the start at (-10, 0)
    assert [found[f'world_{part}'] for part in PARTS] == pytest.approx([0.0, 0.1, 0.02])
    assert found['odom_ate_max_m'] == pytest.approx(math.hypot(0.1, 0.4))
    assert found['global_ate_max_m'] > 0.0 and np.isnan(found[['amcl_x_m', 'amcl_ate_max_m']].astype(float)).all()
    assert found['true_path'].tolist() == [[-10.0, 0.0], [0.0, 0.0], [10.0, 0.1]]
    assert found['odom_path'] == pytest.approx(np.array([[-10.0, 0.0], [0.0, 0.3], [9.9, 0.5]]))
    assert results.requested == {'SL': trial(number=7)}


def test_errors_are_along_the_maps_axes_and_odometry_counts_from_the_start(tmp_path):
    test = load_test('SL', ROOT / 'config').model_dump()
    test['start'] = {'x': 5.0, 'y': 2.0, 'yaw': math.pi / 2}
    test['route'] = [{'goal': {'x': 4.0, 'y': 5.0, 'yaw': math.pi}}]
    about = Trial.from_mapping({'test': test, 'nav': 'embedded'}, '')
    odom, truth = [(0, 0, 0), (3.0, 0.8, 1.6)], [(5.0, 2.0, math.pi / 2), (4.1, 5.3, -3.0)]
    found = load_results([write_bag(tmp_path / 'a.bag', about, odom, truth)]).trials.iloc[0]
    errors = {source: found[[f'{source}_{part}' for part in PARTS]].tolist() for source in ('odom', 'world')}
    assert errors['odom'] == pytest.approx([0.2, 0.0, 1.6 - math.pi / 2])
    assert errors['world'] == pytest.approx([0.1, 0.3, math.pi - 3.0])
    assert found[['amcl_x_m', 'global_x_m']].isna().all()


# One write a line: print makes two of it if Python's output is not buffered, and two processes write.
INTERRUPTED = """
import os, time
from diff_encoder_sim.analysis import results_loading as loading

def read(path):
    os.write(1, b'reading\\n')
    time.sleep(0.3)

loading._trial_or_reason, loading.usable_cores = read, lambda: 2
try:
    loading.read_bag_trials(range(100))
except KeyboardInterrupt:
    print('stopped')
"""


def test_ctrl_c_ends_the_reading_processes_without_output_of_theirs():
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    pipes['env'] = {**os.environ, 'PYTHONPATH': str(SOURCE)}
    process = subprocess.Popen([sys.executable, '-c', INTERRUPTED], **pipes, start_new_session=True)
    assert process.stdout.readline() == 'reading\n'
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    out, err = process.communicate(timeout=30)
    assert (out.splitlines()[-1], err) == ('stopped', '')
