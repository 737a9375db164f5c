"""AMCL against the exact Bayes filter over a fine grid of poses.

What makes the comparison fair:
- Both filter the same thing: the same prior, odometry and scans, the odometry model diff-corrected
  (table 5.6; independent Gaussian turn, drive and turn) and upstream's likelihood-field weights.
  Those are no probabilities, but the posterior that they define is as exact as any. The weights
  are checked against plain Python in test_likelihood_field.py.
- The grid filter has no error of its own that would count. The odometry noise is Gaussian in the
  two turns and the drive, so each is a product in the Fourier domain (exact shifts, no
  interpolation); cells of 3 cm and 2 degrees are below a third of every spread. Its window goes
  along with the robot and reaches five standard deviations.
- AMCL gets 10,000 particles, no KLD limit and no recovery: those trade accuracy for time or for
  finding a lost robot, on purpose. What is left is sampling error, which falls with the root of
  the number of particles.
- The room is uneven, so the posterior has one peak; AMCL's estimate, the heaviest cluster, is then
  the posterior's mean.
"""

import math

import numpy as np
import pytest

from amcl_world import moved, pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.likelihood_field import LikelihoodField
from diff_encoder_sim.localization.odometry_motion import decompose, diff_corrected_noise

PARAMS = dict(
    min_particles=10_000,
    max_particles=10_000,
    laser_max_beams=91,
    update_min_d=0.1,
    recovery_alpha_slow=0.0,
    recovery_alpha_fast=0.0,
    odom_model_type='diff-corrected',
    odom_alpha1=0.03,
    odom_alpha2=0.03,
    odom_alpha3=0.03,
    odom_alpha4=0.03,
    initial_pose_x=1.0,
    initial_pose_y=-0.7,
    initial_pose_a=1.9,
    initial_cov_xx=0.03,
    initial_cov_yy=0.03,
    initial_cov_aa=0.015,
)
TRUE_START = Pose2D(0.9, -0.6, 1.8)
STEPS = 8


class GridFilter:
    """The posterior density on a grid of x, y and all headings."""

    CELL_M, SIDE, HEADINGS = 0.03, 72, 180

    def __init__(self, params, grid):
        self.params = params
        self.field = LikelihoodField(params, grid)
        self.yaws = np.arange(self.HEADINGS) * 2 * math.pi / self.HEADINGS
        self.centre = np.round([params.initial_pose_x / self.CELL_M, params.initial_pose_y / self.CELL_M])
        x, y, yaw = self._coordinates()
        off_yaw = np.angle(np.exp(1j * (yaw - params.initial_pose_a)))
        self.density = np.exp(
            -0.5
            * (
                (x - params.initial_pose_x) ** 2 / params.initial_cov_xx
                + (y - params.initial_pose_y) ** 2 / params.initial_cov_yy
                + off_yaw**2 / params.initial_cov_aa
            )
        )
        self.density /= self.density.sum()

    def _coordinates(self):
        offsets = np.arange(self.SIDE) - self.SIDE // 2
        return np.meshgrid(
            (self.centre[0] + offsets) * self.CELL_M, (self.centre[1] + offsets) * self.CELL_M, self.yaws, indexing='ij'
        )

    def predict(self, previous, current):
        move = decompose(previous, current)
        sigmas = diff_corrected_noise(move, self.params)
        self._turn(move.rotation1_rad, sigmas.rotation1_rad)
        self._drive(move.translation_m, sigmas.translation_m)
        self._turn(move.rotation2_rad, sigmas.rotation2_rad)
        self.density = np.maximum(self.density, 0.0)
        self.density /= self.density.sum()

    def _turn(self, angle_rad, sigma_rad):
        harmonics = np.fft.rfftfreq(self.HEADINGS, 1.0 / self.HEADINGS)
        gain = np.exp(-1j * harmonics * angle_rad - 0.5 * (harmonics * sigma_rad) ** 2)
        self.density = np.fft.irfft(np.fft.rfft(self.density, axis=2) * gain, self.HEADINGS, 2)

    def _drive(self, distance_m, sigma_m):
        """Every heading's slice by its own way; the window goes along with the mean."""
        mean_yaw = self.mean()[2]
        cells = np.round(distance_m * np.array([math.cos(mean_yaw), math.sin(mean_yaw)]) / self.CELL_M)
        self.centre = self.centre + cells
        wave_x = 2 * math.pi * np.fft.fftfreq(self.SIDE, self.CELL_M)[:, None, None]
        wave_y = 2 * math.pi * np.fft.rfftfreq(self.SIDE, self.CELL_M)[None, :, None]
        along = wave_x * np.cos(self.yaws) + wave_y * np.sin(self.yaws)
        window = (wave_x * cells[0] + wave_y * cells[1]) * self.CELL_M
        gain = np.exp(1j * (window - along * distance_m) - 0.5 * (along * sigma_m) ** 2)
        spectrum = np.fft.rfft2(self.density, axes=(0, 1)) * gain
        self.density = np.fft.irfft2(spectrum, (self.SIDE, self.SIDE), axes=(0, 1))

    def correct(self, scan):
        poses = np.stack([axis.ravel() for axis in self._coordinates()], axis=1)
        counts = self.density.ravel() > 1e-12
        weights = np.zeros(self.density.size)
        weights[counts] = self.field.likelihoods(
            np.ascontiguousarray(poses[counts]), self.field.beams(scan, IDENTITY), False
        ).factors
        self.density = self.density * weights.reshape(self.density.shape)
        self.density /= self.density.sum()

    def mean(self):
        x, y, yaw = self._coordinates()
        direction = (self.density * np.exp(1j * yaw)).sum()
        return (self.density * x).sum(), (self.density * y).sum(), np.angle(direction)

    def spread(self):
        x, y, yaw = self._coordinates()
        mean_x, mean_y, _ = self.mean()
        return np.array(
            [
                math.sqrt((self.density * (x - mean_x) ** 2).sum()),
                math.sqrt((self.density * (y - mean_y) ** 2).sum()),
                math.sqrt(-2 * math.log(abs((self.density * np.exp(1j * yaw)).sum()))),
            ]
        )


def drive():
    """(true base pose in the map, base in odom, scan) of each step along an arc."""
    rng = np.random.default_rng(5)
    grid = pillar_room()
    true_pose, odom_pose = TRUE_START, IDENTITY
    for _ in range(STEPS):
        yield odom_pose, simulated_scan(grid, true_pose, rng, sigma_m=0.03)
        true_pose = moved(true_pose, 0.25, 0.35)
        odom_pose = moved(odom_pose, 0.24, 0.33)


@pytest.fixture(scope='module')
def exact():
    """The grid filter's (mean, spread) where AMCL gives an estimate from its weights."""
    params = AmclParams(**PARAMS)
    grid_filter = GridFilter(params, pillar_room())
    results, previous = [], None
    for index, (odom_pose, scan) in enumerate(drive()):
        if previous is not None:
            grid_filter.predict(previous, odom_pose)
        grid_filter.correct(scan)
        previous = odom_pose
        if (index + 1) % params.resample_interval == 0:
            results.append((grid_filter.mean(), grid_filter.spread()))
    return results


@pytest.mark.parametrize('seed', range(6))
def test_mean_and_spread_are_the_exact_filters(exact, seed):
    amcl = Amcl(AmclParams(**PARAMS), pillar_room(), np.random.default_rng(seed))
    estimates = [amcl.update(odom_pose, scan, IDENTITY) for odom_pose, scan in drive()][1::2]
    for estimate, (mean, spread) in zip(estimates, exact):
        error = np.subtract(estimate.base_pose_in_map, mean)
        assert np.hypot(error[0], error[1]) < 0.01
        assert abs(math.degrees(np.angle(np.exp(1j * error[2])))) < 0.5
        assert np.sqrt(np.diag(estimate.covariance)) == pytest.approx(spread, rel=0.2)
