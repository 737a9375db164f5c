"""Read by catkin (catkin_python_setup in CMakeLists.txt); name and version come from package.xml. Not for pip."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import Distribution, find_packages, setup


class CatkinDistribution(Distribution):
    """Leaves pyproject.toml alone, which is pip's: setuptools reads it since version 61, each version differently."""

    def parse_config_files(self, filenames=None, **options):
        """Read the files of distutils alone, which setuptools does where it is given their names."""
        super().parse_config_files(filenames or self.find_config_files(), **options)


setup(
    distclass=CatkinDistribution,
    **generate_distutils_setup(
        packages=find_packages('src'),
        package_dir={'': 'src'},
        package_data={
            'diff_encoder_sim.advice': ['*.html'],
            'diff_encoder_sim.analysis.charts': ['*.html', '*.css', '*.js'],
            'diff_encoder_sim.analysis.report': ['*.html', '*.css', '*.js'],
            'diff_encoder_sim.calibration': ['*.html'],
            'diff_encoder_sim.conformance': ['*.html'],
            'diff_encoder_sim.drives': ['definitions/*/*.msg'],
        },
    ),
)
