"""What is checked of a Dask scheduler before a campaign uses it; whole campaigns are in test/test_campaign.py."""

import pytest
from distributed.versions import get_versions

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.executors import PACKAGES, TlsFiles, check_versions, connected_workers


def changed(**packages):
    versions = get_versions(packages=PACKAGES)
    return {**versions, 'packages': {**versions['packages'], **packages}}


def test_equal_versions_pass_and_of_python_the_minor_version_counts():
    check_versions(changed(), 'worker a')
    major, minor = str(changed()['packages']['python']).split('.')[:2]
    check_versions(changed(python=f'{major}.{minor}.99.final.0'), 'worker a')


@pytest.mark.parametrize(
    ('packages', 'text'),
    [
        ({'numpy': '0.1'}, '--scheduler: numpy is 0.1 on worker a, '),
        ({'numba': None}, '--scheduler: numba is not installed on worker a, '),
        ({'python': '2.7.18.final.0'}, '--scheduler: python is 2.7 on worker a, '),
    ],
)
def test_another_version_is_named(packages, text):
    with pytest.raises(ConfigError) as caught:
        check_versions(changed(**packages), 'worker a')
    assert str(caught.value).startswith(text)


@pytest.mark.parametrize('address', ['tcp://127.0.0.1:1', 'no address'])
def test_where_no_scheduler_answers_is_one_line(address):
    with pytest.raises(ConfigError, match='--scheduler: given') as caught, connected_workers(address):
        pass
    assert '\n' not in str(caught.value)


def test_a_file_of_tls_that_is_missing_is_named(tmp_path):
    cert = tmp_path / 'cert.pem'
    cert.write_text('')
    with pytest.raises(ConfigError, match=r'^--tls-key: given .*key.pem.: No such file or directory; allowed: a file$'):
        TlsFiles(cert, cert, tmp_path / 'key.pem').security()
