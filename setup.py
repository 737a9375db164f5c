"""Read by catkin (catkin_python_setup in CMakeLists.txt); name and version come from package.xml. Not for pip."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import find_packages, setup

setup(
    **generate_distutils_setup(
        packages=find_packages('src'),
        package_dir={'': 'src'},
        package_data={'diff_encoder_sim.analysis.report': ['*.html', '*.css', '*.js']},
    )
)
