"""Where the robot is on a map: adaptive Monte Carlo localization (AMCL), without ROS.

The algorithm is that of amcl in the navigation stack (Noetic). It departs from it where upstream

- seeds its draws by the process: here all come from one generator;
- puts the map half a cell off and leaves out its origin's yaw (sensor.py);
- cuts clusters in two at a heading of +-180 degrees (histogram.py);
- computes distances that are off by part of a cell (distance.py);
- divides the mean likelihood by the number of particles once too often, so that recovery never
  starts once KLD-sampling has reduced them (amcl.py);
- multiplies probabilities until they are zero, and counts rays without a return as rays that
  disagree with the map, in likelihood_field_prob (likelihood_field_prob.py);
- gives no laser_z_max to rays without a return, but to those that are too short, in the beam
  model: here both (beams.py);
- lets a scan in which nothing returned move and resample the particles: here it is refused;
- never checks whether the robot is lost (lost.py; off unless lost_fraction is set).
"""
