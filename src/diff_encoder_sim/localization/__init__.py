"""Where the robot is on a map (AMCL), and the map itself (files, grid SLAM), without ROS.

AMCL's algorithm is that of amcl in the navigation stack (Noetic). It departs from it where upstream

- seeds its draws by the process: here all come from one generator;
- puts the map half a cell off, leaves out its origin's yaw, and computes distances that are off by part of a cell;
- cuts clusters in two at a heading of +-180 degrees;
- divides the mean likelihood by the number of particles once too often, so that recovery never starts once
  KLD-sampling has reduced them;
- multiplies probabilities until they are zero, and counts rays without a return as rays that disagree with the map, in
  likelihood_field_prob;
- gives no laser_z_max to rays without a return, but to those that are too short, in the beam model: here both;
- lets a scan in which nothing returned move and resample the particles: here it is refused;
- never checks whether the robot is lost (off unless lost_fraction is set).
"""
