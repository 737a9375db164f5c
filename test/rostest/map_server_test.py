#!/usr/bin/env python3
"""map_server_node serves what its file says, map_saver saves what is served. Started by localization.test."""

import subprocess
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, LoadMap, LoadMapResponse
from ros_testing import TIMEOUT_S, Collector, start_test_node, wait_until, yaw_of

from diff_encoder_sim.localization.map_files import load_map

WORLDS = Path(__file__).resolve().parents[2] / 'worlds'
# turned_map.pgm from below, row by row: occupancies of 0, 120, 205 and 254 are 1, 0.53, 0.196 and 0.004.
TURNED = [100, 0, -1, 0, 0, 0, -1, -1, 100, -1, 0, 100]


def start_saver(folder, *arguments):
    """A map_saver that runs in a folder of its own."""
    with open(folder / 'log', 'wb') as out:
        command = ['rosrun', 'diff_encoder_sim', 'map_saver', *arguments]
        return subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)


def latched(topic, width=2):
    """A publisher of a map of 2 cells."""
    message = OccupancyGrid(data=[0, 100])
    message.info.width, message.info.height, message.info.resolution = width, 1, 0.05
    message.info.origin.orientation.w = 1.0
    publisher = rospy.Publisher(topic, OccupancyGrid, queue_size=1, latch=True)
    publisher.publish(message)
    return publisher


class MapServerTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        start_test_node('map_server_test')

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def lines(self):
        return [line for line in (self.folder / 'log').read_text().splitlines() if line.strip()]

    def end_of(self, saver):
        """(exit code, lines of output)"""
        self.addCleanup(saver.kill)
        return saver.wait(2.0 * TIMEOUT_S), self.lines()

    def test_all_three_ways_give_the_map_of_the_file_to_everyone_who_comes_late(self):
        rospy.wait_for_service('/turned/static_map', TIMEOUT_S)
        answered = rospy.ServiceProxy('/turned/static_map', GetMap)().map
        for _ in range(2):
            served = Collector('/turned/map', OccupancyGrid).wait_for_count(1)[0]
            metadata = Collector('/turned/map_metadata', MapMetaData).wait_for_count(1)[0]
            served.header.seq = answered.header.seq  # rospy numbers what it publishes
            self.assertEqual((served, metadata), (answered, answered.info))
        self.assertEqual((served.header.frame_id, list(served.data)), ('map', TURNED))
        info = served.info
        self.assertEqual((info.width, info.height), (4, 3))
        self.assertAlmostEqual(info.resolution, 0.05, places=7)
        self.assertEqual((info.origin.position.x, info.origin.position.y, info.origin.position.z), (-1.5, 0.25, 0.0))
        self.assertAlmostEqual(yaw_of(info.origin.orientation), 0.3, places=12)
        self.assertGreater(info.map_load_time.to_sec(), 0.0)
        self.assertEqual(served.header.stamp, info.map_load_time)

    def test_another_map_takes_its_place_and_a_bad_one_does_not(self):
        rospy.wait_for_service('/site/change_map', TIMEOUT_S)
        change = rospy.ServiceProxy('/site/change_map', LoadMap)
        served = Collector('/site/map', OccupancyGrid)
        self.addCleanup(change, str(WORLDS / 'hallway.yaml'))
        answer = change(str(WORLDS / 'ros_logo.yaml'))
        self.assertEqual((answer.result, answer.map.header.frame_id), (LoadMapResponse.RESULT_SUCCESS, 'site_map'))
        self.assertEqual(list(answer.map.data), load_map(WORLDS / 'ros_logo.yaml').cells.ravel().tolist())
        wait_until(lambda: served.messages and served.messages[-1].data == answer.map.data, 'the new map')
        (self.folder / 'bad.yaml').write_text('image: none.pgm')
        for path, result in (
            (self.folder / 'none.yaml', LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST),
            (self.folder / 'bad.yaml', LoadMapResponse.RESULT_INVALID_MAP_DATA),
            ('', LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST),
        ):
            self.assertEqual(change(str(path)).result, result)
        self.assertEqual(rospy.ServiceProxy('/site/static_map', GetMap)().map.data, answer.map.data)

    def test_served_and_saved_and_served_again_is_the_same(self):
        code, lines = self.end_of(start_saver(self.folder, '-f', 'hall', 'map:=/turned/map'))
        self.assertEqual((code, len(lines)), (0, 1), lines)
        self.assertIn(str(self.folder.resolve() / 'hall.yaml'), lines[0])
        saved, first = load_map(self.folder / 'hall.yaml'), load_map(Path(__file__).parent / 'data' / 'turned_map.yaml')
        self.assertTrue((saved.cells == first.cells).all())
        self.assertEqual((saved.resolution_m, saved.origin), (first.resolution_m, first.origin))

    def test_a_map_that_is_none_ends_it_with_one_line(self):
        publisher = latched('/bad/map', width=3)
        code, lines = self.end_of(start_saver(self.folder, 'map:=/bad/map'))
        publisher.unregister()
        self.assertEqual((code, len(lines)), (1, 1), lines)
        self.assertTrue('/bad/map' in lines[0] and 'with 2 values' in lines[0], lines)
        self.assertEqual([entry.name for entry in self.folder.iterdir()], ['log'])

    def test_it_waits_for_a_map_and_says_so(self):
        saver = start_saver(self.folder, 'map:=/late/map')
        wait_until(self.lines, 'a line that it waits', 3.0 * TIMEOUT_S)
        self.assertIn('/late/map: no map has been published yet', self.lines()[0])
        publisher = latched('/late/map')
        code, lines = self.end_of(saver)
        publisher.unregister()
        self.assertEqual(code, 0, lines)
        self.assertEqual(load_map(self.folder / 'map.yaml').cells.tolist(), [[0, 100]])


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'map_files', MapServerTest)
