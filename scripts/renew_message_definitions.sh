#!/usr/bin/env bash
# Takes the message definitions that bags contain (src/diff_encoder_sim/drives/definitions/) from the packages that are
# installed, and msg/. With --check, only compares them, and fails where they differ. Definitions of packages that are not
# installed are left as they are: Debian lacks gazebo_msgs.
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

main() {
  cd "$root/src/diff_encoder_sim/drives/definitions"
  local file installed differing=0
  for file in */*.msg; do
    installed=$(original "${file%/*}" "${file##*/}")
    if [ -z "$installed" ]; then
      say "$file: its package is not installed"
    elif [ "${1-}" != --check ]; then
      cp "$installed" "$file"
    elif ! diff -u "$file" "$installed"; then
      differing=1
    fi
  done
  return "$differing"
}

# original PACKAGE FILE: where the package that is installed has it; nothing if it is not.
original() {
  local folder
  if [ "$1" = diff_encoder_sim ]; then
    echo "$root/msg/$2"
    return
  fi
  for folder in /opt/ros/noetic/share /usr/share; do
    if [ -f "$folder/$1/msg/$2" ]; then
      echo "$folder/$1/msg/$2"
      return
    fi
  done
}

main "$@"
