#!/usr/bin/env bash
# Sets up what the tests need, then runs them all: catkin_lint, ruff, mypy, pytest over test/ (unit tests, rostests and the
# documentation), and the core's unit tests but for heavy ones on Python 3.8, which is Noetic's. Ends with the sum as its last line.
#   bash scripts/test.sh                          everything
#   bash scripts/test.sh test/unit -k wrap        arguments go to pytest, and only pytest runs
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

venv38=$root/.venv38
# Where the caller's environment forbids byte code, each process of a test would compile every module anew.
unset PYTHONDONTWRITEBYTECODE

passed=0 failed=0 skipped=0
declare -A streams=()     # process groups in the background

main() {
  bash "$root/scripts/setup.sh" --test
  drop_root "$@"
  cd "$root"
  find_python38        # before ROS and .venv change what PATH and PYTHONPATH say
  use_loopback
  if [ $# -gt 0 ]; then
    source_workspace
    exec "$venv/bin/python" -m pytest "$@"
  fi
  reports=$(mktemp -d)
  trap 'rm -rf "$reports"' EXIT
  run_tests
  echo
  echo "$passed passed, $failed failed, $skipped skipped"
  [ "$failed" -eq 0 ]
}

# Warnings count too.
lint_package() (
  source_workspace
  catkin_lint -W1 --strict --offline "$root"
)

# What .pre-commit-config.yaml runs, and catkin_lint.
run_linters() {
  check "catkin_lint" lint_package
  if [ ! -x "$venv/bin/mypy" ]; then
    say "ruff and mypy NOT run: they need Python 3.11, this is $("$venv/bin/python" --version)"
    return
  fi
  check "ruff check" "$venv/bin/ruff" check --quiet .
  check "ruff format" "$venv/bin/ruff" format --quiet --check .
  check "mypy" "$venv/bin/mypy"
}

# check NAME COMMAND...: counts as one test.
check() {
  say "$1"
  if "${@:2}"; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
}

# Four streams at a time, as live graphs and campaigns wait for much of theirs, and of a length, as two cores are busy until
# the end only if no stream is alone there.
run_tests() {
  local core=(test/unit test/test_{docs,notebooks}.py test/test_*_in_browser.py)
  local live=(test/test_live_*.py test/test_{launch_files,node_interfaces,rostests,teleop}.py) stream
  begin live check_with_ros live "${live[@]}"
  begin core check_with_ros core "${core[@]}"
  [ -z "$python38" ] || begin unit38 check_unit38
  run_linters
  say "pytest test/ but for the streams beside it on $("$venv/bin/python" --version)"
  check_with_ros rest test "${core[@]/#/--ignore=}" "${live[@]/#/--ignore=}"
  for stream in "${!streams[@]}"; do
    say "waiting for $stream"
    wait "${streams[$stream]}" || true
    cat "$reports/$stream.log"
  done
  count rest
  count live
  count core
  if [ -n "$python38" ]; then count unit38
  else say "Python 3.8 NOT checked: none found (python3.8 on PATH, \$PYTHON38, ~/.pyenv/versions/3.8*)"; fi
}

# begin STREAM COMMAND...: in the background, in a process group of its own, which ends with this script.
begin() {
  set -m
  "${@:2}" >"$reports/$1.log" 2>&1 </dev/null &
  set +m
  streams[$1]=$!
  trap 'for group in "${streams[@]}"; do kill -- "-$group" 2>/dev/null || true; done; rm -rf "$reports"' EXIT
}

# On Python 3.8 too the code has to run, but its numbers need no second proof; and live graphs should not wait for it.
check_unit38() {
  renice -n 5 -p $BASHPID >/dev/null
  ensure_venv "$venv38" "$python38" '' requirements.txt requirements-test.txt
  say "pytest test/unit but for heavy tests on $("$venv38/bin/python" --version)"
  (unset PYTHONPATH; run_pytest unit38 "$venv38/bin/python" test/unit -m 'not heavy') || true
}

# check_with_ros REPORT ARGUMENTS...: with the workspace at hand, a rostest that skips itself for want of ROS is a failure.
check_with_ros() { (source_workspace; ROSTESTS_REQUIRED=1 run_pytest "$1" "$venv/bin/python" "${@:2}") || true; }

# run_pytest REPORT PYTHON ARGUMENTS...
run_pytest() { "$2" -m pytest -p no:cacheprovider "${@:3}" --junitxml="$reports/$1.xml"; }

# count REPORT: adds a run's numbers up. No report or no test is a failure.
count() {
  local numbers
  if numbers=$("$venv/bin/python" - "$reports/$1.xml" <<'PY'
import sys
import xml.etree.ElementTree as ElementTree
suites = list(ElementTree.parse(sys.argv[1]).getroot().iter('testsuite'))
total, bad, skipped = (sum(int(s.get(key, 0)) for s in suites for key in keys)
                       for keys in (('tests',), ('failures', 'errors'), ('skipped',)))
sys.exit('no test ran') if total == skipped else print(total - bad - skipped, bad, skipped)
PY
  ); then
    read -r p f s <<<"$numbers"
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
  else
    say "pytest $1 ran no test or did not finish"
    failed=$((failed + 1))
  fi
}

find_python38() {
  local candidate
  python38=
  for candidate in "${PYTHON38:-}" "$(command -v python3.8 || true)" "$HOME"/.pyenv/versions/3.8*/bin/python; do
    # a pyenv shim is there, but does not run unless its version is chosen
    if [ -n "$candidate" ] && "$candidate" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info[:2] != (3, 8))' 2>/dev/null; then
      python38=$candidate
      return
    fi
  done
}

main "$@"
