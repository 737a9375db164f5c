"""Service calls that end, whatever the service does."""

import threading

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

import rospy
from std_srvs.srv import Empty

from diff_encoder_sim.ros import node


@pytest.fixture(name='serve')
def fixture_serve(monkeypatch):
    def serve(handler):
        monkeypatch.setattr(node.rospy, 'ServiceProxy', lambda service, service_class: handler)

    return serve


def test_a_service_that_never_responds_ends_at_the_limit(serve):
    released = threading.Event()
    serve(lambda: released.wait(30.0))
    with pytest.raises(rospy.ServiceException, match=r'^no response within 0\.05 s$'):
        node.call_service('/gazebo/pause_physics', Empty, limit_s=0.05)
    released.set()


def test_what_the_service_returns_or_raises_is_passed_on(serve):
    serve(lambda request: f'response to {request}')
    assert node.call_service('service', Empty, 'request') == 'response to request'

    def fail():
        raise rospy.ServiceException('service [/service] unavailable')

    serve(fail)
    with pytest.raises(rospy.ServiceException, match='unavailable'):
        node.call_service('service', Empty)
