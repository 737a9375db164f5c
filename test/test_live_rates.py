"""Live trials with encoders that report at other rates than 20 Hz: time waits for nothing that does not come."""

import pytest

from diff_encoder_sim.drives.trial_recording import read_trial
from launched_graph import DATA, ROOT, Graph, complaints, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(180)]

TRIAL = ROOT / 'launch' / 'trial.launch'
CONFIG = (ROOT / 'config' / 'config.yaml').read_text()
TICK_NS, SCRIPTED, NAVIGATED = 10_000_000, 'short_line', 'short_route'


def stamps_ns(rate_hz, end_ns):
    """The first tick at or after each multiple of the period, written down plainly."""
    periods = range(int(end_ns * rate_hz / 1e9) + 1)
    stamps = sorted({-int(-period * 1e9 / rate_hz // TICK_NS) * TICK_NS for period in periods})
    return [stamp for stamp in stamps if stamp <= end_ns]


# With the simulator's periods fixed to 50 ms, 10 Hz lasted 2 s of wall time for each 0.1 s, with a warning.
@pytest.mark.parametrize(('rate', 'test', 'nav'), [(10, NAVIGATED, 'embedded'), (33.3, SCRIPTED, 'scripted')])
def test_a_trial_at_another_report_rate_waits_for_nothing_in_vain(tmp_path, rate, test, nav):
    require_ros()
    assert 'rate: 20.0 ' in CONFIG
    (tmp_path / 'config.yaml').write_text(CONFIG.replace('rate: 20.0 ', f'rate: {rate} '))
    bag = tmp_path / 'trial.bag'
    with Graph(tmp_path) as graph:
        launch = graph.launch(
            TRIAL,
            f'test:={DATA / test}.yaml',
            f'nav:={nav}',
            'rtf:=0',
            f'bag:={bag}',
            f'config:={tmp_path / "config.yaml"}',
        )
        assert launch.wait() == 0, launch.output()
    assert complaints(launch.output()) == []  # each wait that ended without its message would be warned of
    poses = read_trial(bag).poses
    odometry = poses['/odom'].stamps_ns.tolist()
    assert odometry == stamps_ns(rate, odometry[-1])
    estimated = poses['/global_pose'].stamps_ns.tolist()
    assert estimated == [stamp for stamp in odometry if estimated[0] <= stamp <= estimated[-1]]
    truth = poses['/world_pose'].stamps_ns.tolist()
    assert truth == list(range(0, truth[-1] + 1, 50_000_000))
