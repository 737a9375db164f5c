"""evo's command line reads our bags, and agrees with our trajectory error."""

import csv
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from diff_encoder_sim.cli import reencode
from reencoding_drives import drive, write_ros1

pytest.importorskip('evo', reason='evo is not installed: requirements-test.txt')
EVO_APE = Path(sys.executable).with_name('evo_ape')


@pytest.mark.parametrize('ppr', [40, 1024])
def test_absolute_trajectory_error(tmp_path, ppr):
    bag = write_ros1(tmp_path / 'drive.bag', drive())
    reencode.main([str(bag), '--ppr', str(ppr), '--out', str(tmp_path / 'out')])
    (row,) = csv.DictReader((tmp_path / 'out' / 'reencode.csv').read_text().splitlines())
    found = statistics_of(tmp_path, tmp_path / 'out' / f'drive_{ppr}ppr.bag')
    assert float(row['ate_rmse_m']) == pytest.approx(found['rmse'], abs=1e-6)
    assert float(row['ate_max_m']) == pytest.approx(found['max'], abs=1e-6)


def statistics_of(folder, bag):
    done = subprocess.run(
        [
            str(EVO_APE),
            'bag',
            str(bag),
            '/world_pose',
            '/odom',
            '--align_origin',
            '--no_warnings',
            '--save_results',
            str(folder / 'ape.zip'),
        ],
        check=False,
        cwd=str(folder),
        capture_output=True,
        text=True,
        env=dict(os.environ, HOME=str(folder)),
    )  # for evo's settings
    assert done.returncode == 0, done.stdout + done.stderr
    with zipfile.ZipFile(folder / 'ape.zip') as results:
        return json.loads(results.read('stats.json'))
