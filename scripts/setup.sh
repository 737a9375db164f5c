#!/usr/bin/env bash
# Sets the checkout up: ROS and build tools through apt, Python libraries in .venv/, a catkin workspace in .ws/.
# Afterwards `source .ws/devel/setup.bash` is all that a shell needs. Run it again at any time: what is done is skipped.
# With --without-ros, for systems that have no Noetic: the part without ROS in .venv/, and nothing else.
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

with_test=false with_rviz=false without_ros=false

main() {
  parse_arguments "$@"
  use_system_tools_only
  check_checkout
  lock
  if $without_ros; then set_up_without_ros; else set_up_with_ros; fi
}

set_up_with_ros() {
  detect_ros
  install_apt_packages
  # shellcheck disable=SC2046  # a list of words
  ensure_venv "$venv" /usr/bin/python3 --system-site-packages $(requirement_files)
  link_sources
  build_workspace
  compile_kernels
  say "ready: source ${workspace#"$PWD"/}/devel/setup.bash"
}

usage() {
  cat <<'TEXT'
usage: bash scripts/setup.sh [--test] [--rviz]
       bash scripts/setup.sh --without-ros
  --test   also what the tests need (pytest, rostest, catkin_lint, Chromium, ruff, mypy, Sphinx)
  --rviz   also RViz, for rviz:=true (big)
  --without-ros   only what needs no ROS: .venv/bin/diff-encoder-sim, with any Python from 3.8 to 3.13
Installs apt packages as root (through sudo when run by a user), Python libraries into .venv/, and builds .ws/.
TEXT
}

parse_arguments() {
  for argument in "$@"; do
    case $argument in
      --test) with_test=true ;;
      --rviz) with_rviz=true ;;
      --without-ros) without_ros=true ;;
      -h|--help) usage; exit 0 ;;
      *) die "unknown option '$argument'; allowed: --test, --rviz, --without-ros, --help" ;;
    esac
  done
  if $without_ros && { $with_test || $with_rviz; }; then die "--without-ros installs neither tests nor RViz: give it alone"; fi
}

# The build must not pick up a python, cmake or workspace that happens to be on the user's PATH (pyenv, conda, another ROS).
use_system_tools_only() {
  export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
  unset PYTHONPATH PYTHONHOME VIRTUAL_ENV CMAKE_PREFIX_PATH ROS_PACKAGE_PATH ROS_DISTRO ROS_ROOT ROS_ETC_DIR CONDA_PREFIX
}

check_checkout() {
  # catkin and the first line of a script ("#!/path/to/python") both end a path at a blank
  case $root in *[[:space:]]*) die "the checkout's path has a blank in it, which catkin cannot build: move it: $root" ;; esac
  [ "$EUID" -eq 0 ] || [ -w "$root" ] || die "cannot write to $root: run as its owner $(stat -c %U "$root"), or with sudo"
}

# Two set-ups at the same time would tear each other's work. What a step starts inherits the lock: when this script is
# killed alone, the next run waits for the pip or make that it left behind.
lock() {
  as_owner mkdir -p "$workspace"
  as_owner touch "$workspace/setup.lock" "$log"
  exec 9>"$workspace/setup.lock"
  flock -n 9 || { say "another set-up of this checkout is running: waiting for it"; flock 9; }
}

# --- ROS and the system's packages --------------------------------------------------------------------------------------

detect_ros() {
  local release=unknown
  # shellcheck disable=SC1091
  [ ! -r /etc/os-release ] || release=$(. /etc/os-release; echo "${VERSION_CODENAME:-${ID:-unknown}}")
  if [ -f /opt/ros/noetic/setup.bash ]; then
    ros=noetic
  elif [ "$release" = bookworm ]; then
    ros=debian
  elif [ "$release" = focal ]; then
    refuse "no ROS here: install ROS Noetic first (wiki.ros.org/noetic/Installation/Ubuntu, ros-noetic-ros-core is enough), then run this again"
  else
    refuse "this system ($release) has no ROS Noetic: needed is Ubuntu 20.04 with /opt/ros/noetic, or Debian 12"
  fi
}

refuse() {
  say "$1" >&2
  die "all but the live ROS graph needs no ROS, and is installed by: bash scripts/setup.sh --without-ros"
}

# The packages, one group a line: what for, then names.
wanted_packages() {
  local name
  echo python3-venv                                                       # .venv/
  echo g++ make cmake                                                     # catkin's CMake asks for a compiler
  case ${ros:-none} in
    debian)
      echo ros-core rosbash rospack-tools                                 # roslaunch, rosbag, rostopic, ..., rosrun
      echo catkin ros-message-generation ros-message-runtime           # catkin_make with EncoderPulse
      echo python3-rospy python3-tf2-ros tf2-tools                        # nodes; static_transform_publisher
      # message classes; definitions and the package.xml with which rosmsg and catkin find them
      for name in actionlib-msgs diagnostic-msgs geometry-msgs map-msgs move-base-msgs nav-msgs sensor-msgs std-msgs std-srvs tf2-msgs visualization-msgs; do
        echo "python3-$name ros-$name lib$name-dev"
      done
      echo python3-actionlib                                             # move_base's action
      # parameters that change while nodes run; the package.xml with which rosrun finds its dynparam
      echo python3-dynamic-reconfigure libdynamic-reconfigure-config-init-mutex-dev
      echo python3-rosgraph-msgs ros-rosgraph-msgs libros-rosgraph-msgs-dev
      echo ros-robot-state-publisher
      ;;
    noetic)
      echo ros-noetic-ros-core ros-noetic-tf2-ros                         # has catkin, rostest and the common messages
      echo ros-noetic-robot-state-publisher ros-noetic-xacro ros-noetic-move-base-msgs
      echo ros-noetic-map-msgs ros-noetic-dynamic-reconfigure            # changes of costmaps, of parameters
      ;;
  esac
  if $with_test; then
    echo catkin-lint openssl    # openssl: certificates of a test
    # librostest-dev for catkin_make run_tests; Chromium looks at the report (Ubuntu has it as a snap only)
    [ $ros = noetic ] || echo python3-rostest librostest-dev chromium
  fi
  if $with_rviz; then
    [ $ros = noetic ] && echo ros-noetic-rviz || echo rviz
  fi
}

missing_packages() {
  local name
  for name in $(wanted_packages); do
    [ "$(dpkg-query -W -f '${db:Status-Abbrev}' "$name" 2>/dev/null | cut -c1-3)" = 'ii ' ] || echo "$name"
  done
}

install_apt_packages() {
  local missing
  missing=$(missing_packages | paste -sd' ')
  [ -n "$missing" ] || return 0
  check_rights "$missing"
  say "needs from apt: $missing"
  # a set-up that was killed while dpkg worked leaves packages half configured
  [ -z "$(dpkg --audit 2>/dev/null)" ] || step "finishing an interrupted dpkg" as_root dpkg --configure -a
  step "updating apt's package lists" as_root apt-get -q update
  check_available "$missing"
  # shellcheck disable=SC2086  # a list of words
  step "installing $(wc -w <<<"$missing") packages and what they need" \
    as_root apt-get -q -y --no-install-recommends install $missing
}

check_rights() {
  [ "$EUID" -ne 0 ] || return 0
  # sudo -v asks for the password here, where it is seen, if it asks at all
  if command -v sudo >/dev/null && { { [ -t 0 ] && sudo -v; } || sudo -n true; } 2>/dev/null; then return; fi
  die "$(id -un) cannot install apt packages (no sudo); run as root: apt-get install --no-install-recommends $1"
}

as_root() {
  local environment=(env DEBIAN_FRONTEND=noninteractive)
  [ "$EUID" -eq 0 ] || environment=(sudo -n "${environment[@]}")
  case $1 in
    apt-get) "${environment[@]}" apt-get -o DPkg::Lock::Timeout=300 "${@:2}" ;;
    *) "${environment[@]}" "$@" ;;
  esac 9>&-          # apt has a lock of its own, and may start services, which must not keep ours
}

check_available() {
  local name unknown=
  for name in $1; do
    apt-cache show "$name" >/dev/null 2>&1 || unknown+=" $name"
  done
  [ -z "$unknown" ] || die "apt does not know$unknown: is the package source of ROS ($ros) configured and reachable? see $log"
}

# --- the part without ROS -----------------------------------------------------------------------------------------------

set_up_without_ros() {
  local mark=$venv/.stamp-package key
  # Debian and Ubuntu have these two in a package of their own
  /usr/bin/python3 -c 'import venv, ensurepip' 2>/dev/null || install_apt_packages
  ensure_venv "$venv" /usr/bin/python3 '' requirements.txt
  key=$(cd "$root"; cat pyproject.toml package.xml requirements.txt | hash_of)
  if ! is_stamped "$mark" "$key"; then
    # editable: the checkout's files are used where they are
    step "installing diff_encoder_sim into .venv" pip_in "$venv" --no-deps --editable "$root"
    stamp "$mark" "$key"
  fi
  compile_kernels
  "$venv/bin/python" -c 'import pybullet' >/dev/null 2>&1 || say "$("$venv/bin/python" --version) has no wheel of PyBullet, which" \
    "simulation needs; this builds it (a C++ compiler, ten minutes): .venv/bin/pip install pybullet"
  say "ready: .venv/bin/diff-encoder-sim campaign --config quick --out results/quick"
}

# --- Python and catkin --------------------------------------------------------------------------------------------------

# Else the first trial of each of several workers would wait for numba. The machine code stays beside the sources. Numbers
# that kernels use may stand in any of these; where none of them changed, compiling takes a second.
compile_kernels() {
  local key mark=$venv/.stamp-kernels
  key=$({ "$venv/bin/python" -c 'import sys; print(sys.version)'
          cat "$venv/.stamp-requirements.txt"
          cd "$root/src"
          find . -name '*.py' | LC_ALL=C sort | xargs sha256sum; } | hash_of)
  ! is_stamped "$mark" "$key" || return 0
  step "compiling kernels" as_owner env PYTHONPATH="$root/src" "$venv/bin/python" -c \
    'from diff_encoder_sim.cli.compile_kernels import main; main()'
  stamp "$mark" "$key"
}

requirement_files() {
  echo requirements.txt
  $with_test || return 0
  echo requirements-test.txt
  # Noetic's Python 3.8 is older than mypy and the documentation's builder
  [ $ros = noetic ] || echo requirements-lint.txt requirements-docs.txt
}

# A folder of links, because a workspace whose src/ holds the whole checkout finds each executable several times.
link_sources() {
  local links=$workspace/src/diff_encoder_sim entry name
  as_owner mkdir -p "$links"
  for entry in "$links"/*; do
    [ -e "$entry" ] || [ ! -L "$entry" ] || as_owner rm "$entry"            # what it pointed to is gone
  done
  for entry in "$root"/*; do
    name=${entry##*/}
    case $name in results|build|devel|install) continue ;; esac              # made by runs, not part of the package
    [ "$(readlink "$links/$name" || true)" = "../../../$name" ] || as_owner ln -sfn "../../../$name" "$links/$name"
  done
}

# What the workspace depends on. Python and launch files are not in it: in a devel space they are used where they are.
workspace_key() {
  { echo "$root $ros"
    "$venv/bin/python" -c 'import sys; print(sys.version)'
    cd "$root"
    sha256sum package.xml CMakeLists.txt setup.py cfg/* msg/*
    ls scripts
  } | hash_of
}

build_workspace() {
  local key mark=$workspace/.stamp
  key=$(workspace_key)
  if is_stamped "$mark" "$key" && [ -f "$workspace/devel/setup.bash" ]; then return; fi
  as_owner rm -rf "$workspace/build" "$workspace/devel" "$mark"              # a torn or moved build is not worth repairing: seconds
  step "building the catkin workspace" as_owner bash -c "$(build_command)"
  [ -f "$workspace/devel/setup.bash" ] || die "catkin_make left no $workspace/devel/setup.bash: see $log"
  stamp "$mark" "$key"
}

# Testing is off: the tests run through pytest (scripts/test.sh), and CMake then looks for neither gtest nor rostest.
build_command() {
  [ "$ros" != noetic ] || echo 'source /opt/ros/noetic/setup.bash;'
  echo "cd '$workspace' && catkin_make -DPYTHON_EXECUTABLE='$venv/bin/python' -DCATKIN_ENABLE_TESTING=OFF"
}

main "$@"
