#!/usr/bin/env bash
# Builds the wheel as pip does, installs it with its libraries from PyPI into a clean environment of each given Python, and runs
# its commands there, far from the checkout and without ROS. The first one simulates a trial, whose bag all of them read.
#   bash scripts/check_wheel.sh python3.8 python3.11 python3.13
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

main() {
  [ $# -gt 0 ] || die "given no Python; allowed: one or more, such as python3.8, the first one not newer than 3.11"
  folder=$(mktemp -d)
  log=$folder/log
  trap '[ $? -eq 0 ] || tail -n 30 "$log"; rm -rf "$folder"' EXIT
  local python
  for python in "$@"; do check_python "$python"; done
}

check_python() {
  local python=$1 venv=$folder/venv
  say "$("$python" --version)"
  rm -rf "$venv" "$folder/home"
  mkdir "$folder/home"
  cd "$folder/home"
  "$python" -m venv "$venv"
  alone pip install --disable-pip-version-check "$root"
  alone diff-encoder-sim --version
  alone diff-encoder-sim check-robot --help
  if "$venv/bin/python" -c 'import pybullet' 2>/dev/null; then
    alone diff-encoder-sim check-robot burger
    alone diff-encoder-sim campaign --config quick --tests SL --ppr 40 --trials 1 --record full --out results
    cp results/bags/SL_40_001.bag "$folder/drive.bag"
  else
    step "check-robot names the extra [sim]" bash -c "! env -i '$venv/bin/diff-encoder-sim' check-robot burger 2>&1 >/dev/null | grep -v 'extra \[sim\]'"
  fi
  alone diff-encoder-sim rasterise-world "$root/worlds/hallway.world" --out map
  alone diff-encoder-sim analyze "$folder/drive.bag" --out analysis
  alone diff-encoder-sim reencode "$folder/drive.bag" --ppr 20 40 --out what_if
  alone diff-encoder-sim calibrate "$folder/drive.bag" --robot alto --out my_alto.yaml
  alone diff-encoder-sim advise --wheel-diameter 0.2 --wheel-separation 0.45 --out advice
  alone diff-encoder-sim map-bag "$folder/drive.bag" -f mapped
}

# alone COMMAND...: with nothing of this shell's environment.
alone() { step "${*##*/}" env -i PATH="$venv/bin:/usr/bin:/bin" HOME="$folder/home" "$@"; }

main "$@"
