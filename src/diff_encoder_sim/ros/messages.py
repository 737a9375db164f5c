"""Messages: conversions between the core's types and ROS's, publishers, subscribers, displays and diagnostics."""

from __future__ import annotations

import warnings
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Callable, Optional, Type

import genpy
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose, PoseStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Odometry
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import MOST_AHEAD_S, NANOSECONDS_PER_SECOND, check_stamp
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives.message_decoders import PoseDecoder, encoded_stamp_ns, planar_pose
from diff_encoder_sim.ros.node import is_ending, log, one_at_a_time
from diff_encoder_sim.wheels.diagnostics import Diagnosis
from diff_encoder_sim.wheels.odometry import OdometryEstimate

if TYPE_CHECKING:  # nodes of an encoder import this module
    from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid

MessageClass = Type[genpy.Message]


def ns_from_stamp(stamp: rospy.Time) -> int:
    """Return nanoseconds since the epoch of the clock in use."""
    return int(stamp.to_nsec())


def stamp_from_ns(stamp_ns: int) -> rospy.Time:
    """Convert integer nanoseconds to ROS time."""
    return rospy.Time(*divmod(stamp_ns, 1_000_000_000))


def clock_ns() -> int:
    """Return the time of the clock in use."""
    return ns_from_stamp(rospy.Time.now())


def header(stamp_ns: int, frame: str) -> Header:
    """Return the header of a message."""
    return Header(stamp=stamp_from_ns(stamp_ns), frame_id=frame)


def pose_message(pose: Pose2D) -> Pose:
    """Convert a planar pose."""
    return Pose().deserialize(encoders.encode_planar_pose(pose))


def pose_stamped_message(pose: Pose2D, stamp_ns: int, frame: str) -> PoseStamped:
    """Convert a planar pose with stamp and frame."""
    return PoseStamped().deserialize(encoders.encode_pose_stamped(pose, stamp_ns, frame))


def map_message(grid: OccupancyGrid, stamp_ns: int, frame: str) -> OccupancyGridMessage:
    """Convert a grid, row by row from the origin."""
    return OccupancyGridMessage().deserialize(encoders.encode_map(grid, stamp_ns, frame))


def pose_from_message(pose: Pose) -> Pose2D:
    """Project a pose to the floor; InputFault if a number is not finite, or the quaternion is invalid."""
    return _pose_on_floor(pose.position, pose.orientation)


def pose_from_transform(transform: TransformStamped) -> Pose2D:
    """Convert a transform to the child's pose in the parent, projected to the floor."""
    return _pose_on_floor(transform.transform.translation, transform.transform.rotation)


def _pose_on_floor(position: Any, rotation: Any) -> Pose2D:
    return planar_pose(position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w)


class EncodedMessage(rospy.AnyMsg):  # type: ignore[misc]  # rospy has no types
    """Serialized message of one type; `encoded_class` builds the class of a type."""

    _has_header = False

    def __init__(self, content: bytes = b'') -> None:
        super().__init__()
        self.content = content
        self.header = SimpleNamespace(seq=0, frame_id='')  # rospy numbers the messages here

    def serialize(self, buff: Any) -> None:
        """Write the message, with its sequence number if it has a header."""
        buff.write(encoders.with_seq(self.content, self.header.seq) if self._has_header else self.content)

    def deserialize(self, content: bytes) -> EncodedMessage:
        """Store the bytes."""
        self.content = content
        return self


def encoded_class(message_class: MessageClass) -> Type[EncodedMessage]:
    """Return the class of encoded messages of a type, which rospy accepts as this type."""
    described = {name: getattr(message_class, name) for name in ('_type', '_md5sum', '_full_text', '_has_header')}
    made: Type[EncodedMessage] = type(f'Encoded{message_class.__name__}', (EncodedMessage,), described)
    return made


class Publisher(rospy.Publisher):  # type: ignore[misc]
    """Publisher of messages or their bytes; `publish` returns when the message is in every subscriber's socket.

    So no message is dropped, except during shutdown, and publishing takes a third of the time of rospy's queues.
    """

    def __init__(self, topic: str, message_class: MessageClass, **options: Any) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', SyntaxWarning)  # about the missing queue_size, which is intended
            super().__init__(topic, message_class, tcp_nodelay=True, **options)
        self._encoded = encoded_class(message_class)

    def publish(self, message: Any) -> None:
        """Publish a message, or its bytes; the seq of a leading header is filled in."""
        try:
            super().publish(self._encoded(message) if isinstance(message, bytes) else message)
        except rospy.ROSException:
            if not is_ending():
                raise


def subscriber(topic: str, message_class: MessageClass, callback: Callable[[Any], None]) -> rospy.Subscriber:
    """Subscribe without a queue limit (-1; None would keep /clock's), and without delay on the publisher's side."""
    return rospy.Subscriber(topic, message_class, one_at_a_time(callback), queue_size=-1, tcp_nodelay=True)


def encoded_subscriber(
    topic: str, message_class: MessageClass, callback: Callable[[bytes], None], most_ahead_s: float = MOST_AHEAD_S
) -> rospy.Subscriber:
    """Call back with the bytes of messages that begin with a header.

    A message too far ahead of the clock, or for which the callback raises InputFault, is dropped with a warning.
    """
    resolved_name = rospy.resolve_name(topic)

    def on_message(message: EncodedMessage) -> None:
        try:
            check_stamp(encoded_stamp_ns(message.content), clock_ns(), most_ahead_s)
            callback(message.content)
        except InputFault as fault:
            log.warning('%s: %s; message dropped', resolved_name, fault)

    return subscriber(topic, encoded_class(message_class), on_message)


def pose_subscriber(
    topic: str, callback: Callable[[int, Pose2D], None], message_class: MessageClass = PoseStamped
) -> rospy.Subscriber:
    """Call back with (stamp_ns, pose in the message's frame); an invalid pose is dropped with a warning."""
    decoder = PoseDecoder(message_class._type.replace('/', '/msg/'))
    return encoded_subscriber(topic, message_class, lambda content: callback(*decoder.decode(content)[:2]))


class DisplayTopic:
    """Topic for displays; newer messages replace the oldest of the `queue_size` that wait for a slow one."""

    def __init__(self, topic: str, message_class: MessageClass, queue_size: int = 1) -> None:
        self._publisher = rospy.Publisher(topic, message_class, queue_size=queue_size)
        self.publish, self.subscriber_count = self._publisher.publish, self._publisher.get_num_connections
        self._known_count = 0
        self._due_ns: Optional[int] = None  # last due time

    def is_due(self, period_ns: float, now_ns: int) -> bool:
        """Return whether there is a subscriber, and the period has elapsed or time jumped back."""
        is_over = self._due_ns is None or not 0 <= now_ns - self._due_ns < period_ns
        if not (is_over and self.subscriber_count()):
            return False
        self._due_ns = now_ns
        return True

    def has_newcomers(self) -> bool:
        """Return whether there are more subscribers than at the last call."""
        before, self._known_count = self._known_count, self.subscriber_count()
        return self._known_count > before


class OdometryOutput:
    """Publishes estimates on a topic and, with publish_tf, as the transform odom -> base."""

    def __init__(self, odom_frame: str, base_frame: str, publish_tf: bool, topic: str = 'odom') -> None:
        self._frames = odom_frame, base_frame
        self._odom = Publisher(topic, Odometry)
        self._transforms = Publisher('/tf', TFMessage) if publish_tf else None

    def publish(self, estimate: OdometryEstimate) -> None:
        """Publish an estimate with a new stamp."""
        if self._transforms is not None:
            transform = estimate.base_pose_in_odom, estimate.stamp_ns, *self._frames
            self._transforms.publish(encoders.encode_planar_tf(*transform))
        self._odom.publish(encoders.encode_odometry(estimate, *self._frames))


class Diagnostics:
    """Publishes a status `NODE: TITLE` on /diagnostics, once per period of stamps, if there are subscribers."""

    def __init__(self, title: str, period_s: float = 1.0) -> None:
        self._title, self._period_ns = title, period_s * NANOSECONDS_PER_SECOND
        self._topic = DisplayTopic('/diagnostics', DiagnosticArray, queue_size=10)

    def publish_when_due(self, stamp_ns: int, diagnose: Callable[[], Diagnosis]) -> None:
        """Publish the result of `diagnose` if a period has elapsed: OK without a warning."""
        if not self._topic.is_due(self._period_ns, stamp_ns):
            return
        diagnosis = diagnose()
        level = DiagnosticStatus.WARN if diagnosis.warning else DiagnosticStatus.OK
        name = f'{rospy.get_name().lstrip("/")}: {self._title}'
        values = [KeyValue(key, f'{value:.6g}') for key, value in diagnosis.values.items()]
        status = DiagnosticStatus(level, name, diagnosis.warning or 'OK', 'None', values)
        self._topic.publish(DiagnosticArray(header(stamp_ns, ''), [status]))
