"""One process at a time writes into a results folder."""

import errno
import signal
import subprocess
import sys

from campaign_files import RUN, refusal
from diff_encoder_sim.trials import results as results_lock
from diff_encoder_sim.trials.results import ResultStore


def test_two_campaigns_do_not_write_into_one_folder(campaign, tmp_path):
    with ResultStore(tmp_path, campaign, RUN):
        assert 'another campaign is writing here' in refusal(tmp_path, campaign)
    with ResultStore(tmp_path, campaign, RUN):
        pass


def test_a_lock_dies_with_its_process(campaign, tmp_path):
    script = (
        'import fcntl, os, signal, sys; file = open(sys.argv[1], "ab"); '
        'fcntl.flock(file, fcntl.LOCK_EX); os.kill(os.getpid(), signal.SIGKILL)'
    )
    holder = subprocess.run([sys.executable, '-c', script, tmp_path / '.lock'], check=False)
    assert holder.returncode == -signal.SIGKILL
    with ResultStore(tmp_path, campaign, RUN) as store:
        assert store.pending() == campaign.jobs()


def test_without_locks_there_is_a_warning(campaign, tmp_path, monkeypatch, caplog):
    def no_locks(*_):
        raise OSError(errno.ENOLCK, 'No locks available')

    monkeypatch.setattr(results_lock.fcntl, 'flock', no_locks)
    with ResultStore(tmp_path, campaign, RUN):
        assert 'no locks' in caplog.text
