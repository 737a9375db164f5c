"""The message and service classes of gazebo_msgs that the nodes use, whether the package is installed or not.

Debian's ROS lacks gazebo_msgs. Where it is missing, each class is built from its definition under its real name, so
that it has the original's checksum, and programs that have the package can communicate with it.
"""

from __future__ import annotations

from typing import Any, Dict, Type

import genpy
from genmsg import MsgContext, SrvSpec, compute_md5
from genpy.dynamic import generate_dynamic
from geometry_msgs.msg import Pose, Twist
from std_msgs.msg import Header

from diff_encoder_sim.drives.message_types import MODEL_STATES
from diff_encoder_sim.drives.typestore import full_text

__all__ = ['STATES_PERIOD_HEADER', 'GetModelState', 'ModelStates', 'SetModelState', 'built_message', 'built_service']

# The field of a connection header in which simulator_node specifies the period of its /gazebo/model_states [ns].
STATES_PERIOD_HEADER = 'states_period_ns'

_SEPARATOR = '\n' + 80 * '=' + '\n'

_MODEL_STATE = """\
string model_name
geometry_msgs/Pose pose
geometry_msgs/Twist twist
string reference_frame"""

_SET_MODEL_STATE_REQUEST = 'gazebo_msgs/ModelState model_state'

_SET_MODEL_STATE_RESPONSE = """\
bool success
string status_message"""

_GET_MODEL_STATE_REQUEST = """\
string model_name
string relative_entity_name"""

_GET_MODEL_STATE_RESPONSE = """\
std_msgs/Header header
geometry_msgs/Pose pose
geometry_msgs/Twist twist
bool success
string status_message"""


def built_message(name: str, definition: str) -> Type[genpy.Message]:
    """Build the class of a message from the fields in its .msg file."""
    return _built_messages(name, definition)[name]


def built_service(name: str, request: str, response: str) -> Type[Any]:
    """Build the class of a service from both halves of its .srv file."""
    messages = _built_messages(f'{name}Request', request)
    messages.update(_built_messages(f'{name}Response', response))
    context = MsgContext.create_default()
    for message_name, message in messages.items():
        context.register(message_name, message._spec)  # genpy's own name for what it parsed
    request_class, response_class = messages[f'{name}Request'], messages[f'{name}Response']
    spec = SrvSpec(request_class._spec, response_class._spec, f'{request}\n---\n{response}', name)
    return type(
        name.split('/')[1],
        (),
        {
            '_type': name,
            '_md5sum': compute_md5(context, spec),
            '_request_class': request_class,
            '_response_class': response_class,
        },
    )


def _built_messages(name: str, definition: str) -> Dict[str, Type[genpy.Message]]:
    """Build the class of a message, and those of its fields, by name."""
    parts = [f'MSG: {part._type}\n{part._full_text}' for part in (Pose, Twist, Header)]
    parts.append(f'MSG: gazebo_msgs/ModelState\n{_MODEL_STATE}')
    return dict(generate_dynamic(name, _SEPARATOR.join([definition, *parts])))


try:
    from gazebo_msgs.msg import ModelStates
except ImportError:
    # The text that bags contain, from a live trial as in lockstep.
    ModelStates = generate_dynamic('gazebo_msgs/ModelStates', full_text(MODEL_STATES))['gazebo_msgs/ModelStates']

try:
    from gazebo_msgs.srv import GetModelState, SetModelState
except ImportError:
    SetModelState = built_service('gazebo_msgs/SetModelState', _SET_MODEL_STATE_REQUEST, _SET_MODEL_STATE_RESPONSE)
    GetModelState = built_service('gazebo_msgs/GetModelState', _GET_MODEL_STATE_REQUEST, _GET_MODEL_STATE_RESPONSE)
