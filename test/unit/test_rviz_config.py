"""config/rviz/trial.rviz shows what a trial has to show; that its topics are published, test_launch_files.py holds."""

import yaml

from places import CONFIG as CONFIG_FOLDER

CONFIG = CONFIG_FOLDER / 'rviz' / 'trial.rviz'

# What is shown, by its topic
SHOWN = {
    **dict.fromkeys(('/map', '/move_base/global_costmap/costmap', '/move_base/local_costmap/costmap'), 'Map'),
    '/move_base/local_costmap/footprint': 'Polygon',
    '/scan': 'LaserScan',
    '/particlecloud': 'PoseArray',
    **dict.fromkeys(('/move_base/NavfnROS/plan', '/move_base/DWAPlannerROS/local_plan'), 'Path'),
    '/odom': 'Odometry',
    '/amcl_pose': 'PoseWithCovariance',
    **dict.fromkeys(('/global_pose', '/world_pose'), 'Pose'),
    **dict.fromkeys(('/odom_path', '/global_pose_path', '/world_pose_path'), 'Path'),
    '/world_markers': 'MarkerArray',
}


def displays(items):
    """Each display that is switched on, and so is its group."""
    for item in items:
        if item['Enabled']:
            yield item
            yield from displays(item.get('Displays', []))


def test_map_scan_particles_costmaps_plans_and_poses_are_shown():
    manager = yaml.safe_load(CONFIG.read_text())['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == 'map'
    found = list(displays(manager['Displays']))
    assert {'rviz/RobotModel', 'rviz/TF'} < {display['Class'] for display in found}
    by_topic = {display.get('Topic') or display.get('Marker Topic'): display for display in found}
    by_topic.pop(None)
    assert {topic: display['Class'] for topic, display in by_topic.items()} == {
        topic: 'rviz/' + kind for topic, kind in SHOWN.items()
    }
    # The four poses are arrows that differ. rviz/Odometry keeps below Shape what the others have next to it.
    poses = [by_topic[topic] for topic in ('/odom', '/amcl_pose', '/global_pose', '/world_pose')]
    arrows = [pose['Shape'] if isinstance(pose['Shape'], dict) else {**pose, 'Value': pose['Shape']} for pose in poses]
    assert {arrow['Value'] for arrow in arrows} == {'Arrow'}
    assert len({arrow['Color'] for arrow in arrows}) == len({arrow['Shaft Length'] for arrow in arrows}) == 4
