"""Private parameters: a node reads the given values and writes the values in use, which `rosparam get` shows.

A node that is started again on the same master would read its own values as given ones, and these override the defaults
of a new trial. So each start stores both, in one parameter below RECORDS.
"""

from __future__ import annotations

import json
from typing import Any, Dict, Mapping

import rospy

from diff_encoder_sim.base.xml_rpc import for_xml_rpc

RECORDS = '/diff_encoder_sim/parameters_at_start'


def given_parameters(private: Mapping[str, Any]) -> Dict[str, Any]:
    """Return private parameters without the values that an earlier start of this node has written."""
    try:
        given, in_use = json.loads(rospy.get_param(RECORDS + rospy.get_name(), ''))
        is_cleared = not in_use.keys() <= private.keys()  # by roslaunch's clear_params, or `rosparam delete`
        return dict(private) if is_cleared else _unchanged_as_given(private, in_use, given)
    except (TypeError, ValueError, AttributeError):
        return dict(private)  # the first start, or not a record


def write_parameters(given: Mapping[str, Any], in_use: Mapping[str, Any]) -> None:
    """Write the values in use to the private parameters; `given` are those of `given_parameters`."""
    values = for_xml_rpc(in_use)
    rospy.set_param(RECORDS + rospy.get_name(), json.dumps([given, values], default=str))
    rospy.set_param('~', values)


def _unchanged_as_given(now: Mapping[str, Any], in_use: Mapping[str, Any], given: Mapping[str, Any]) -> Dict[str, Any]:
    result = {}
    for key, value in now.items():
        before = given.get(key, {})
        if key not in in_use:
            result[key] = value
        elif value == in_use[key]:
            if key in given:
                result[key] = given[key]
        elif all(isinstance(each, dict) for each in (value, in_use[key], before)):
            result[key] = _unchanged_as_given(value, in_use[key], before)
        else:
            result[key] = value
    return result
