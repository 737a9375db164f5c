"""PyBullet prints a line when it is imported, which would end up in results and progress bars."""

import subprocess
import sys

from places import SOURCE


def test_importing_pybullet_prints_nothing_and_later_prints_are_seen():
    script = 'from diff_encoder_sim.simulation.bullet import pybullet; print("after")'
    result = subprocess.run(
        [sys.executable, '-c', script],
        env={'PYTHONPATH': str(SOURCE), 'PATH': ''},
        capture_output=True,
        text=True,
        check=True,
    )
    assert (result.stdout, result.stderr) == ('after\n', '')
