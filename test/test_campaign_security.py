"""Who can reach the processes of a campaign: only themselves."""

import asyncio
import socket

import psutil
import pytest
from distributed import rpc
from distributed.security import Security

from campaign_processes import Machine, campaign_lines, finish, results, workers_of

pytestmark = pytest.mark.timeout(300)


@pytest.fixture
def machine(tmp_path):
    machine = Machine(tmp_path)
    yield machine
    machine.close()


def listening(process):
    """(address, port) of all that a process and its children listen to."""
    processes = [process, *process.children(recursive=True)]
    connections = [each for process in processes for each in process.net_connections('all')]
    return [tuple(each.laddr) for each in connections if each.status == psutil.CONN_LISTEN]


def answer_to_http(address):
    with socket.create_connection(address, timeout=5) as connection:
        connection.sendall(b'GET /status HTTP/1.1\r\nHost: localhost\r\n\r\n')
        try:
            return connection.recv(1000)
        except ConnectionResetError:
            return b''


def may_ask(address, protocol, security):
    """Whether a Dask process of somebody else gets an answer."""

    async def ask():
        arguments = security.get_connection_args('client')
        async with rpc('{}://{}:{}'.format(protocol, *address), timeout=2, connection_args=arguments) as peer:
            return await asyncio.wait_for(peer.identity(), 3)

    try:
        return bool(asyncio.run(ask()))
    except (OSError, asyncio.TimeoutError):
        return False


def test_no_port_of_a_campaign_speaks_http_or_takes_a_stranger(machine):
    process = machine.campaign('--workers', '1', trial_s=0.4)
    machine.wait_for_attempts(1)
    assert 'PRIVATE KEY' not in str([worker.cmdline() for worker in workers_of(process)])  # which every user can read
    ports = listening(psutil.Process(process.pid))
    assert len(ports) == 2  # the scheduler and the worker
    for address in ports:
        assert address[0] == '127.0.0.1'
        assert not answer_to_http(address).startswith(b'HTTP')
        assert not may_ask(address, 'tcp', Security())
        assert not may_ask(address, 'tls', Security.temporary())
    code, _, err = finish(process)
    assert (code, campaign_lines(err)) == (0, []), err
    assert [line for line in err if not line[0].isdigit()] == []  # but for progress
    assert len(results(machine.out)[0]) == 24


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
