"""Where trials run; whole campaigns, with kills, are in test/test_campaign.py."""

import os
import time
from concurrent.futures.process import BrokenProcessPool

import pytest
from distributed.versions import get_versions

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.executors import (
    ENVIRONMENT,
    PACKAGES,
    TlsFiles,
    check_versions,
    connected_workers,
    local_workers,
)


def changed(**packages):
    versions = get_versions(packages=PACKAGES)
    return {**versions, 'packages': {**versions['packages'], **packages}}


def test_a_broken_pool_is_replaced_and_its_environment_is_its_own():
    with local_workers(1) as workers:
        with pytest.raises(BrokenProcessPool):
            workers.submit(os._exit, 1).result()
        assert workers.submit(os.getenv, 'OMP_NUM_THREADS').result() == '1'
        assert workers.count() == 1
        worker = workers.submit(os.getpid).result()
        begin_s = time.monotonic()
        workers.submit(time.sleep, 60.0)
    assert time.monotonic() - begin_s < 30.0
    with pytest.raises(ProcessLookupError):
        os.kill(worker, 0)
    assert not set(ENVIRONMENT) & {name for name, value in os.environ.items() if value == '65536'}


def test_equal_versions_pass_and_of_python_the_minor_version_counts():
    check_versions(changed(), changed(), 'worker a')
    major, minor = str(changed()['packages']['python']).split('.')[:2]
    check_versions(changed(python=f'{major}.{minor}.99.final.0'), changed(), 'worker a')


@pytest.mark.parametrize('packages', [{'numpy': '0.1'}, {'numba': None}, {'python': '2.7.18.final.0'}])
def test_another_version_is_named(packages):
    with pytest.raises(ConfigError, match=f'--scheduler: {next(iter(packages))} is .* on worker a'):
        check_versions(changed(**packages), changed(), 'worker a')


@pytest.mark.parametrize('address', ['tcp://127.0.0.1:1', 'no address'])
def test_a_missing_scheduler_is_reported(address):
    with pytest.raises(ConfigError, match='--scheduler: given'), connected_workers(address):
        pass


def test_a_file_of_tls_that_is_missing_is_named(tmp_path):
    cert = tmp_path / 'cert.pem'
    cert.write_text('')
    with pytest.raises(ConfigError, match='--tls-key: given .*key.pem'):
        TlsFiles(cert, cert, tmp_path / 'key.pem').security()
