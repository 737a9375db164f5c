#!/usr/bin/env bash
# Maps the shipped worlds anew, as the paper did: ideal odometry, a LiDAR of 1 cm noise, grid SLAM.
#   bash scripts/remake_maps.sh [WORLD...]      writes worlds/WORLD.pgm and .yaml; needs scripts/setup.sh first
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

[ $# -gt 0 ] || set -- hallway ros_logo
use_loopback
source_workspace
for world in "$@"; do
  port=$(free_port)
  say "mapping $world"
  ROS_MASTER_URI=http://127.0.0.1:$port roslaunch -p "$port" diff_encoder_sim mapping.launch \
    world:="$world" rtf:=0 out:="$root/worlds/$world" || die "$world was not mapped (roslaunch ended with $?)"
done
