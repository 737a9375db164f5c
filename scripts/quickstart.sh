#!/usr/bin/env bash
# Sets up, drives one trial on a live ROS graph, and prints how far odometry was from the truth.
#   scripts/quickstart.sh                            the straight line at 90 pulses per revolution, as fast as possible
#   scripts/quickstart.sh test:=SMT ppr:=40 ...      arguments go to trial.launch instead of the default ones
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

arguments=("$@")
[ $# -gt 0 ] || arguments=(test:=SL ppr:=90 rtf:=0)

main() {
  local setup_options=()
  ! [[ " ${arguments[*]} " =~ \ rviz:=([Tt]rue|1)\  ]] || setup_options=(--rviz)
  bash "$root/scripts/setup.sh" "${setup_options[@]}"
  drop_root "${arguments[@]}"
  choose_bag
  local master=()
  choose_master
  use_loopback
  source_workspace
  say "roslaunch diff_encoder_sim trial.launch ${arguments[*]}"
  roslaunch "${master[@]}" diff_encoder_sim trial.launch "${arguments[@]}" || die "the trial failed (roslaunch ended with $?)"
  [ -s "$bag" ] || die "the trial left no bag: $bag"
  rosrun diff_encoder_sim analyze "$bag"
}

# value NAME DEFAULT: what the arguments give for NAME:=
value() {
  local argument found=$2
  for argument in "${arguments[@]}"; do
    [ "${argument%%:=*}" != "$1" ] || found=${argument#*:=}
  done
  printf '%s' "$found"
}

choose_bag() {
  bag=$(value bag '')
  if [ -z "$bag" ]; then
    local name
    name=$(printf '%s_%sppr' "$(value test SL)" "$(value ppr 90)" | tr -cs 'A-Za-z0-9._-' '_')
    bag=$root/results/quickstart/${name}_$(date -u +%Y%m%dT%H%M%SZ).bag
    arguments+=("bag:=$bag")
  fi
  mkdir -p "$(dirname "$bag")"
}

# A master of its own, unless the user names one: a trial neither joins nor disturbs somebody's roscore.
# Sourcing any ROS set-up file leaves the value localhost:11311, so that one is nobody's choice.
choose_master() {
  case ${ROS_MASTER_URI:-} in
    ''|http://localhost:11311|http://localhost:11311/)
      local port
      port=$(free_port)
      # kept from source_workspace, which would set the usual one
      export ROS_MASTER_URI=http://127.0.0.1:$port
      master=(-p "$port") ;;
  esac
}

main
