"""The provenance of results."""

import os
import subprocess

from diff_encoder_sim.base.processes import cpu_model, git, usable_cores


def test_the_host_has_a_processor_with_a_name():
    assert cpu_model()
    assert 1 <= usable_cores() <= os.cpu_count()


def test_git_reports_a_commit_where_there_is_one(tmp_path):
    assert git(tmp_path, 'rev-parse', 'HEAD') is None
    assert git(tmp_path / 'nowhere', 'status') is None
    subprocess.run(['git', 'init', '-q', str(tmp_path)], check=True)
    assert git(tmp_path, 'rev-parse', '--is-inside-work-tree') == 'true'


def test_without_git_there_is_no_commit(tmp_path, monkeypatch):
    monkeypatch.setenv('PATH', str(tmp_path))
    assert git(tmp_path, 'status') is None
