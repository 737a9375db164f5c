"""Robots of 60 kinds with tags of 200: those with two driven wheels are described, all others are refused."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from plugin_tags import variant
from urdf_texts import described

VARIANTS = 60


@pytest.mark.parametrize('number', range(VARIANTS))
def test_a_robot_is_accepted_by_its_wheels_and_not_by_words_in_tags(number):
    text, driven = variant(number)
    if driven:
        description = described(text)
        assert (description.left.joint, description.right.joint) == driven
        return
    with pytest.raises(ConfigError, match='given a robot|given an omnidirectional'):
        described(text)
