"""config/rviz/trial.rviz shows what a trial has to show; that its topics are published, test_launch_files.py holds."""

import yaml

from places import CONFIG as CONFIG_FOLDER

CONFIG = CONFIG_FOLDER / 'rviz' / 'trial.rviz'

# What is shown, by its topic
SHOWN = {
    '/map': 'Map',
    '/move_base/global_costmap/costmap': 'Map',
    '/move_base/local_costmap/costmap': 'Map',
    '/move_base/local_costmap/footprint': 'Polygon',
    '/scan': 'LaserScan',
    '/particlecloud': 'PoseArray',
    '/move_base/NavfnROS/plan': 'Path',
    '/move_base/DWAPlannerROS/local_plan': 'Path',
    '/odom': 'Odometry',
    '/amcl_pose': 'PoseWithCovariance',
    '/global_pose': 'Pose',
    '/world_pose': 'Pose',
    '/odom_path': 'Path',
    '/global_pose_path': 'Path',
    '/world_pose_path': 'Path',
    '/world_markers': 'MarkerArray',
}
POSES = ('/odom', '/amcl_pose', '/global_pose', '/world_pose')


def displays(items):
    """Each display that is switched on, and so is its group."""
    for item in items:
        if item['Enabled']:
            yield item
            yield from displays(item.get('Displays', []))


def shown():
    """Displays by topic."""
    manager = yaml.safe_load(CONFIG.read_text())['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == 'map'
    found = list(displays(manager['Displays']))
    assert {'rviz/RobotModel', 'rviz/TF'} < {display['Class'] for display in found}
    return {
        topic: display for display in found for topic in [display.get('Topic') or display.get('Marker Topic')] if topic
    }


def test_map_scan_particles_costmaps_plans_and_poses_are_shown():
    assert {topic: display['Class'] for topic, display in shown().items()} == {
        topic: 'rviz/' + kind for topic, kind in SHOWN.items()
    }


def test_the_four_poses_are_arrows_that_can_be_told_apart():
    poses = [shown()[topic] for topic in POSES]
    # rviz/Odometry keeps below Shape what the others have beside it.
    arrows = [pose['Shape'] if isinstance(pose['Shape'], dict) else {**pose, 'Value': pose['Shape']} for pose in poses]
    assert {arrow['Value'] for arrow in arrows} == {'Arrow'}
    assert len({arrow['Color'] for arrow in arrows}) == len({arrow['Shaft Length'] for arrow in arrows}) == 4
