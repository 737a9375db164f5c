"""The exact Bayes filter over a fine grid of poses: independent of particles, resampling and their statistics.

The odometry noise is Gaussian in the two turns and the drive, so each is a product in the Fourier domain (exact
shifts, no interpolation). Cells of 3 cm and 2 degrees should be below a third of every spread; the window goes along
with the robot.
"""

import math

import numpy as np

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.localization.laser_models import laser_model
from diff_encoder_sim.localization.particles import decompose, move_noise


class GridFilter:
    """The posterior density on a grid of x, y and all headings."""

    CELL_M, SIDE, HEADINGS = 0.03, 72, 180

    def __init__(self, params, grid):
        self.params = params
        self.model = laser_model(params, grid)
        self.yaws = np.arange(self.HEADINGS) * 2 * math.pi / self.HEADINGS
        self.centre = np.round([params.initial_pose_x / self.CELL_M, params.initial_pose_y / self.CELL_M])
        x, y, yaw = self._coordinates()
        squares = (x - params.initial_pose_x) ** 2 / params.initial_cov_xx
        squares += (y - params.initial_pose_y) ** 2 / params.initial_cov_yy
        squares += np.angle(np.exp(1j * (yaw - params.initial_pose_a))) ** 2 / params.initial_cov_aa
        self.density = np.exp(-0.5 * squares)
        self.density /= self.density.sum()

    def _coordinates(self):
        offsets = np.arange(self.SIDE) - self.SIDE // 2
        return np.meshgrid(
            (self.centre[0] + offsets) * self.CELL_M, (self.centre[1] + offsets) * self.CELL_M, self.yaws, indexing='ij'
        )

    def predict(self, previous, current):
        move = decompose(previous, current)
        sigmas = move_noise(move, self.params)
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
        beams = self.model.beams(scan, IDENTITY)
        weights[counts] = self.model.likelihoods(np.ascontiguousarray(poses[counts]), beams, False).factors
        self.density = self.density * weights.reshape(self.density.shape)
        self.density /= self.density.sum()

    def mean(self):
        x, y, yaw = self._coordinates()
        direction = (self.density * np.exp(1j * yaw)).sum()
        return (self.density * x).sum(), (self.density * y).sum(), np.angle(direction)

    def spread(self):
        x, y, yaw = self._coordinates()
        mean_x, mean_y, _ = self.mean()
        squares = (self.density * (x - mean_x) ** 2).sum(), (self.density * (y - mean_y) ** 2).sum()
        return np.sqrt([*squares, -2 * math.log(abs((self.density * np.exp(1j * yaw)).sum()))])
