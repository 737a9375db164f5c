# shellcheck shell=bash
# Shell functions that setup.sh, quickstart.sh and test.sh share. Sourced, not run; needs bash and nothing else.
# The functions use: me (name for messages), root (the checkout), log (where steps write their output).

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
me=$(basename "$0" .sh)
log=$root/.ws/setup.log
venv=$root/.venv
workspace=$root/.ws

say() { printf '%s: %s\n' "$me" "$*"; }
die() { printf '%s: %s\n' "$me" "$*" >&2; exit 1; }

# --- whose checkout it is -----------------------------------------------------------------------------------------------
# Under sudo only apt runs as root. What is made in the checkout belongs to the checkout's owner, or that person could
# neither update nor delete it later.
owner=$(stat -c %u "$root")
running_for_someone_else() { [ "$EUID" -eq 0 ] && [ "$owner" -ne 0 ]; }

as_owner() {
  running_for_someone_else || { "$@"; return; }
  local name home=/tmp groups=--clear-groups     # a bind-mounted checkout's owner may have no account here
  if name=$(id -un "$owner" 2>/dev/null); then
    home=$(getent passwd "$owner" | cut -d: -f6)
    groups=--init-groups
  fi
  setpriv --reuid="$owner" --regid="$(stat -c %g "$root")" "$groups" \
    env HOME="$home" USER="${name:-$owner}" LOGNAME="${name:-$owner}" "$@"
}

# --- steps --------------------------------------------------------------------------------------------------------------
# step NAME COMMAND...: one line with the time it took; the command's output goes to the log.
step() {
  local name=$1 began=$SECONDS; shift
  printf '%s: %s ... ' "$me" "$name"
  printf '\n=== %s: %s\n+ %s\n' "$(date -u +%FT%TZ)" "$name" "$*" >>"$log"
  "$@" >>"$log" 2>&1 </dev/null || { echo failed; die "stopped at '$name': see $log"; }
  echo "$((SECONDS - began)) s"
}

hash_of() { sha256sum | cut -c1-64; }
is_stamped() { [ -f "$1" ] && [ "$(cat "$1")" = "$2" ]; }
stamp() { printf '%s\n' "$2" | as_owner tee "$1" >/dev/null; }

# --- virtual environments -----------------------------------------------------------------------------------------------
# ensure_venv DIR PYTHON 'VENV OPTIONS' REQUIREMENTS...: an environment with these requirement files installed.
# Stamps say what is done; `.incomplete` is there while pip works, so that a torn environment is made anew.
ensure_venv() {
  local dir=$1 python=$2 options=$3 file key; shift 3
  local name=${dir##*/}
  key=$("$python" -c 'import sys; print(sys.version)' | cat - <(echo "$dir $python $options") | hash_of)
  if [ -e "$dir/.incomplete" ] || ! is_stamped "$dir/.stamp-venv" "$key" || ! "$dir/bin/python" -c 'import pip' 2>/dev/null; then
    as_owner rm -rf "$dir"
    # shellcheck disable=SC2086  # options is a list of words
    step "making $name from $("$python" --version)" as_owner "$python" -m venv $options "$dir"
    # Ubuntu 20.04's pip is too old to know the names that wheels have today
    as_owner touch "$dir/.incomplete"
    step "checking pip in $name" pip_in "$dir" 'pip>=20.3'
    as_owner rm "$dir/.incomplete"
    stamp "$dir/.stamp-venv" "$key"
  fi
  for file in "$@"; do ensure_requirements "$dir" "$file"; done
}

ensure_requirements() {
  local dir=$1 file=$2 mark key constraints
  mark=$dir/.stamp-$file
  constraints=$(constraints_of "$dir/bin/python")
  key=$(cat "$root/$file" ${constraints:+"$constraints"} | hash_of)
  ! is_stamped "$mark" "$key" || ! has_requirements "$dir" "$file" || return 0
  as_owner touch "$dir/.incomplete"
  step "installing into ${dir##*/} from PyPI: $(requirement_names "$file" | paste -sd" ")" \
    pip_in "$dir" -r "$root/$file" ${constraints:+-c "$constraints"}
  as_owner rm "$dir/.incomplete"
  stamp "$mark" "$key"
}

pip_in() { as_owner "$1/bin/python" -m pip install --quiet --disable-pip-version-check --no-input --prefer-binary "${@:2}"; }

# The exact versions for a Python, in constraints/: equal seeds give equal bags only with equal numpy and numba. For other
# Pythons there are none; the newest versions are taken then.
constraints_of() {
  local file
  file=$root/constraints/python$("$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])').txt
  [ ! -f "$file" ] || echo "$file"
}

requirement_names() { grep -oE '^[A-Za-z0-9][A-Za-z0-9._-]*' "$root/$1"; }

# Someone may have removed a package by hand: ask for each that this Python needs by its name (in milliseconds, unlike pip).
has_requirements() {
  "$1/bin/python" - "$root/$2" 2>/dev/null <<'PY'
import sys
from importlib.metadata import version
from pip._vendor.packaging.requirements import Requirement
for requirement in (Requirement(line.split(' #')[0]) for line in open(sys.argv[1]) if line[0].isalnum()):
    if requirement.marker is None or requirement.marker.evaluate():
        version(requirement.name)
PY
}

# --- the ROS environment ------------------------------------------------------------------------------------------------
# Sources the workspace as a user does. ROS's set-up files use variables that are not set, hence +u.
source_workspace() {
  set +u
  # shellcheck disable=SC1091
  source "$workspace/devel/setup.bash" || die "cannot source $workspace/devel/setup.bash"
  set -u
  # Noetic's tools start with "env python3": let that be the python that sees rospy, whatever else is on PATH (pyenv, conda)
  export PATH="$venv/bin:$PATH"
}

# ROS talks over loopback unless the user chose an address.
use_loopback() { [ -n "${ROS_IP:-}${ROS_HOSTNAME:-}" ] || export ROS_IP=127.0.0.1; }

free_port() { "$venv/bin/python" -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

# Under sudo: after the set-up as root, goes on as the checkout's owner, so that what a run leaves behind is that person's.
drop_root() {
  running_for_someone_else || return 0
  as_owner bash "$0" "$@" && exit 0 || exit $?
}
