"""The stand-in for Gazebo: an SDF world, a URDF robot in PyBullet, and simulated time."""
