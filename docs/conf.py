"""Configure Sphinx.

`.venv/bin/python -m sphinx -W --keep-going -b html docs .ws/docs` builds the site, without ROS or a network.
"""

import os
import sys
from pathlib import Path
from xml.etree import ElementTree

from pydantic import BaseModel

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / 'src'), str(ROOT / 'docs' / '_ext')]
os.environ['NUMBA_DISABLE_JIT'] = '1'  # kernels stay functions, with docstring and signature

package = ElementTree.parse(ROOT / 'package.xml').getroot()
project = package.findtext('name')
author = package.findtext('author')
release = version = package.findtext('version')
copyright = f'{author}, BSD-3-Clause'

extensions = [
    'myst_parser',
    'sphinx.ext.autodoc',
    'sphinx.ext.napoleon',
    'api_pages',
    'calculator',
    'encoder_table',
    'node_tables',
    'notebook_pages',
    'reference_tables',
    'robot_table',
]
exclude_patterns = ['_ext']
myst_enable_extensions = ['colon_fence', 'deflist']
myst_heading_anchors = 3

default_role = 'code'  # `name` in a docstring
napoleon_google_docstring = True
napoleon_numpy_docstring = False
autodoc_member_order = 'bysource'
autodoc_typehints_format = 'short'
autodoc_use_type_comments = False  # there are none, and looking for them takes a tenth of the time
autodoc_default_options = {'exclude-members': 'model_config'}
add_module_names = False
python_maximum_signature_line_length = 100
toc_object_entries = False
autodoc_mock_imports = [
    *('actionlib', 'actionlib_msgs', 'diagnostic_msgs', 'dynamic_reconfigure', 'gazebo_msgs', 'genpy'),
    *('geometry_msgs', 'map_msgs', 'message_filters', 'move_base_msgs', 'nav_msgs', 'rosbag', 'rosgraph'),
    *('rosgraph_msgs', 'roslib', 'rospkg', 'rospy', 'sensor_msgs', 'std_msgs', 'std_srvs', 'tf2_msgs', 'tf2_py'),
    *('tf2_ros', 'visualization_msgs', 'diff_encoder_sim.cfg', 'diff_encoder_sim.msg'),
]

html_theme = 'furo'
html_title = f'{project} {version}'
html_static_path = ['_static']
html_css_files = ['site.css']
html_search_scorer = str(ROOT / 'docs' / '_static' / 'search_scorer.js')
html_copy_source = html_show_sourcelink = False


def drop_signature(_app, _what, _name, obj, _options, _signature, _returns):
    """Leave out the arguments of parameter classes: the pages have tables of them."""
    return ('', None) if isinstance(obj, type) and issubclass(obj, BaseModel) else None


def setup(app):
    """Register with Sphinx."""
    app.connect('autodoc-process-signature', drop_signature)
