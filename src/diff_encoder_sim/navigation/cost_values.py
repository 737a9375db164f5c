"""Cost values of costmap_2d; those between free and inscribed come from inflation."""

FREE = 0
INSCRIBED = 253  # the robot touches an obstacle whatever its heading
LETHAL = 254  # an obstacle
NO_INFORMATION = 255  # unknown space
