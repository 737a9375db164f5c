"""What robot_state_publisher gets: a frame for every link."""

from xml.etree import ElementTree

from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import display_urdf, expand
from places import ROOT

WHEELS = ('left_wheel_joint', 'right_wheel_joint')
ALTO = RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')


def kinds(urdf):
    return {joint.get('name'): joint.get('type') for joint in ElementTree.fromstring(urdf).findall('joint')}


def robot(tmp_path, more):
    path = tmp_path / 'robot.urdf'
    path.write_text(expand(ALTO).replace('</robot>', f'{more}</robot>'))
    return RobotSource(path)


def test_a_joint_without_a_state_is_fixed(tmp_path):
    mast = (
        '<link name="mast"/><joint name="lift" type="prismatic"><parent link="base_link"/><child link="mast"/>'
        '<limit lower="0" upper="1" effort="1" velocity="1"/></joint>'
    )
    found = kinds(display_urdf(robot(tmp_path, mast), WHEELS))
    assert found['lift'] == 'fixed'
    assert {found[name] for name in WHEELS} == {'continuous'}


def test_the_root_link_has_no_inertia(tmp_path):
    """robot_state_publisher would warn of it."""
    urdf = display_urdf(robot(tmp_path, ''), WHEELS)
    (root,) = [link for link in ElementTree.fromstring(urdf).findall('link') if link.get('name') == 'base_link']
    assert root.find('inertial') is None


def test_a_robot_with_an_argument_for_it_stays_as_its_author_wrote_it():
    with_argument = ALTO._replace(arguments=(('root_inertia', 'false'),))
    assert display_urdf(ALTO, WHEELS) == expand(with_argument)
