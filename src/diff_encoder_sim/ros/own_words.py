"""A command line without what roslaunch adds to it."""

from __future__ import annotations

import sys
from typing import List


def own_words() -> List[str]:
    """Return the words after the command, without remappings: rospy.myargv, without the half second of its import."""
    return [word for word in sys.argv[1:] if ':=' not in word]
