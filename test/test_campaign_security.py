"""Who can reach the processes of a campaign: only themselves."""

import socket

import psutil
import pytest
from distributed.security import Security

from campaign_processes import Machine, finish, results

pytestmark = pytest.mark.timeout(300)


@pytest.fixture
def machine(tmp_path):
    machine = Machine(tmp_path)
    yield machine
    machine.close()


def test_a_campaign_on_one_machine_opens_no_port(machine):
    process = machine.campaign('--workers', '1', trial_s=0.4)
    machine.wait_for_attempts(1)
    client = psutil.Process(process.pid)
    connections = [each for one in (client, *client.children(recursive=True)) for each in one.net_connections('all')]
    assert [each for each in connections if each.status == psutil.CONN_LISTEN and each.family != socket.AF_UNIX] == []
    assert finish(process)[0] == 0


@pytest.fixture
def certificates(tmp_path):
    """Paths of a certificate, which signs itself, and of its key."""
    made = Security.temporary()
    for name, text in (('cert.pem', made.tls_client_cert), ('key.pem', made.tls_client_key)):
        (tmp_path / name).write_text(text)
    return tmp_path / 'cert.pem', tmp_path / 'key.pem'


def test_a_cluster_with_certificates_takes_who_has_one(machine, certificates):
    cert, key = certificates
    address, _, _ = machine.cluster(1, tls=('--tls-ca-file', cert, '--tls-cert', cert, '--tls-key', key))
    assert address.startswith('tls://')
    code, _, err = finish(machine.campaign('--scheduler', address))
    assert code == 1
    assert len(err) == 1 and err[0].startswith('campaign: --scheduler: given ')
    code, _, err = finish(
        machine.campaign('--scheduler', address, '--tls-ca', cert, '--tls-cert', cert, '--tls-key', key)
    )
    assert code == 0, err
    assert len(results(machine.out)[0]) == 24
