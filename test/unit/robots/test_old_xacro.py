"""xacros as they were until ROS Melodic."""

from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion
from diff_encoder_sim.robots.xacro_process import NOTE

PARTS = """<robot><property name="radius" value="0.1"/>
  <macro name="ball" params="r"><geometry><sphere radius="${r}"/></geometry></macro>
  <macro name="wheel" params="name *place"><link name="${name}"><collision><ball r="${radius}"/></collision>
    <weight/></link>
    <joint name="${name}_joint" type="continuous"><parent link="base"/><child link="${name}"/>
    <insert_block name="place"/></joint></macro>
  <macro name="weight"><inertial><mass value="2"/></inertial></macro>
  <macro name="camera"><link name="camera"/>
    <joint name="c" type="fixed"><parent link="base"/><child link="camera"/></joint>
    <gazebo><sensor><camera name="not a call"/></sensor></gazebo></macro>
</robot>"""
ROBOT = """<robot name="old" xmlns:xacro="http://ros.org/wiki/xacro"><include filename="parts.xacro"/>
  <link name="base"/><if value="${radius > 0}"><wheel name="left"><origin xyz="0 ${radius} 0"/></wheel></if>
  <unless value="1"><link name="never"/></unless><xacro:camera/></robot>"""


def test_tags_and_macros_without_prefix_are_xacros(tmp_path):
    (tmp_path / 'parts.xacro').write_text(PARTS)
    (tmp_path / 'r.xacro').write_text(ROBOT)
    result = expansion(RobotSource(tmp_path / 'r.xacro'))
    tree = parse_urdf(result.urdf, 'r')
    assert sorted(tree.links) == ['base', 'camera', 'left'] and tree.links['left'].inertial.mass_kg == 2
    assert tree.links['left'].collisions[0].geometry.radius_m == 0.1
    assert tree.joints['left_joint'].child_in_parent[1, 3] == 0.1
    assert '<camera name="not a call"/>' in result.urdf
    assert result.notes == (NOTE,)


def test_a_new_xacro_is_left_alone(tmp_path):
    path = tmp_path / 'r.xacro'
    path.write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:macro name="inertial"><inertial/></xacro:macro>'
        '<link name="a"><xacro:inertial/></link><link name="b"><inertial/></link>'
        '<gazebo><include><uri>model://a</uri></include><if/></gazebo></robot>'
    )
    result = expansion(RobotSource(path))
    assert result.notes == () and result.urdf.count('<inertial/>') == 2 and '<include>' in result.urdf
