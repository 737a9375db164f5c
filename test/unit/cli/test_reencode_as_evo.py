"""For one bag, reencode, analyze and evo's command line have the same errors: the commands of the documentation."""

import csv
import io
import json
import math
import os
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from campaign_files import small_campaign
from diff_encoder_sim.analysis.result_tables import csv_text
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.analysis.tables import path_error_table
from diff_encoder_sim.cli import reencode
from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, RpePairs, rpe_name
from diff_encoder_sim.drives.trial_definition import TrialPlan
from places import ROOT

pytest.importorskip('evo', reason='evo is not installed: requirements-test.txt')
from evo.core import filters  # only if it is installed

from lockstep_trials import run_trial

BAG = 'sl.bag'
COMMANDS = [line for line in (ROOT / 'docs' / 'recorded_drives.md').read_text().splitlines() if line.startswith('evo_')]


@pytest.fixture(name='trial_folder', scope='module')
def fixture_trial_folder(tmp_path_factory):
    """A trial of SL at 90 PPR, as a campaign runs it."""
    folder = tmp_path_factory.mktemp('trial')
    campaign = small_campaign(folder, tests=['SL'], ppr=[90])
    world, robot = ROOT / 'worlds' / 'hallway.world', ROOT / 'urdf' / 'alto.urdf.xacro'
    files = dict(world=str(world), map=str(world.with_suffix('.yaml')), bag=str(folder / BAG))
    plan = TrialPlan(trial=campaign.trials()[0].definition(), **files)
    run_trial(plan, robot, campaign.cells[0].robot_params, 'minimal')
    return folder


@pytest.fixture(name='reencoded', scope='module')
def fixture_reencoded(trial_folder):
    """The row of reencode.csv at the PPR of the trial."""
    reencode.main([str(trial_folder / BAG), '--ppr', '90', '--out', str(trial_folder / 'out')])
    (row,) = csv.DictReader((trial_folder / 'out' / 'reencode.csv').read_text().splitlines())
    return row


def evo(folder, command):
    """Statistics of a command line of evo, and the number of errors."""
    tool, *arguments = shlex.split(command)
    (folder / 'evo.zip').unlink(missing_ok=True)
    words = [str(Path(sys.executable).with_name(tool)), *arguments, '--no_warnings', '--save_results', 'evo.zip']
    environment = dict(os.environ, HOME=str(folder))  # for evo's settings
    done = subprocess.run(words, cwd=str(folder), capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    with zipfile.ZipFile(folder / 'evo.zip') as results:
        errors = np.load(io.BytesIO(results.read('error_array.npy')))
        return json.loads(results.read('stats.json')), len(errors)


@pytest.mark.parametrize('command', COMMANDS)
def test_the_commands_of_the_documentation_find_what_analyze_and_reencode_find(trial_folder, reencoded, command):
    table, words = path_error_table(load_results([trial_folder / BAG])), shlex.split(command)
    source = words[4].strip('/').split('_')[0]
    (row,) = (row for row in csv.DictReader(io.StringIO(csv_text(table))) if row['source'] == source)
    # Of each error: the columns of analyze and reencode, evo's statistic, and how many of reencode's units it has.
    errors = [('ate_rmse_mean_m', 'ate_rmse_m', 'rmse', 1.0), ('ate_max_m', 'ate_max_m', 'max', 1.0)]
    segments, poses = None, 'common_stamps'
    if command.startswith('evo_rpe'):
        pairs = RpePairs.ALL if '--all_pairs' in words else RpePairs.CONSECUTIVE
        straight = np.tile(np.eye(4), (30, 1, 1))
        straight[:, 0, 3] = 0.1 * np.arange(30)
        if pairs is RpePairs.CONSECUTIVE and filters.filter_pairs_by_path(straight, 1.0)[0][0]:
            pytest.skip('this evo, before 1.32, leaves out the first of the consecutive segments')
        name = rpe_name(pairs, float(words[words.index('--delta') + 1]))
        errors = [(f'{name}_translation_rmse_mean_m', f'{name}_position_rmse_m', 'rmse', 1.0)]
        if 'angle_deg' in words:
            errors = [(f'{name}_rotation_rmse_mean_deg', f'{name}_yaw_rmse_rad', 'rmse', 180.0 / math.pi)]
        segments = poses = f'{name}_segments'
    statistics, count = evo(trial_folder, command)
    assert segments is None or int(row[segments]) == count
    assert source != 'odom' or int(reencoded[poses]) == count
    for of_analyze, of_reencode, statistic, scale in errors:
        assert float(row[of_analyze]) == pytest.approx(statistics[statistic], abs=1e-6)
        if source == 'odom':
            assert scale * float(reencoded[of_reencode]) == pytest.approx(statistics[statistic], abs=1e-6)


def test_the_table_in_the_terminal_has_the_segments(trial_folder, reencoded, capsys):
    reencode.main([str(trial_folder / BAG), '--ppr', '90'])
    words = [line.split() for line in capsys.readouterr().out.splitlines()]
    for distance_m in RPE_DISTANCES_M:
        expected = [f'{distance_m:g}', 'm']
        for pairs in RpePairs:
            name = rpe_name(pairs, distance_m)
            yaw_deg = math.degrees(float(reencoded[f'{name}_yaw_rmse_rad']))
            expected += [reencoded[f'{name}_segments'], f'{float(reencoded[f"{name}_position_rmse_m"]):.4f}']
            expected.append(f'{yaw_deg:.3f}')
        assert ['90', *expected] in words
    assert int(reencoded['rpe_10m_segments']) in (1, 2)
