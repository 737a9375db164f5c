#!/usr/bin/env bash
# Sets up what the tests need, then runs them: catkin_lint, ruff, mypy, pytest over test/ (unit tests, ROS graphs, commands,
# documentation) on all cores, and test/smoke on Python 3.8, which is Noetic's. Longer checks: scripts/test_long.sh.
#   bash scripts/test.sh                          everything
#   bash scripts/test.sh test/unit -k wrap        arguments go to pytest, and only pytest runs
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

venv38=$root/.venv38
# Where the caller's environment forbids byte code, each process of a test would compile every module anew.
unset PYTHONDONTWRITEBYTECODE

main() {
  bash "$root/scripts/setup.sh" --test
  drop_root "$@"
  cd "$root"
  find_python38        # before ROS and .venv change PATH and PYTHONPATH
  use_loopback
  if [ $# -gt 0 ]; then
    source_workspace
    exec "$venv/bin/python" -m pytest "$@"
  fi
  failed=()
  begin_smoke38
  run_linters
  source_workspace
  # With ROS at hand, a test of ROS that skips itself is a failure. Tests of one file share a graph or a campaign; live graphs
  # wait for much of their time, hence one process more than there are cores. They come before the unit tests, in the order of names.
  ROSTESTS_REQUIRED=1 "$venv/bin/python" -m pytest -m 'not long' -p no:cacheprovider -n "$(($(nproc) + 1))" --dist loadfile --no-loadscope-reorder \
    ${python38:+--ignore test/smoke} test || failed+=(pytest)
  end_smoke38
  [ ${#failed[@]} -eq 0 ] || die "failed: ${failed[*]}"
  say "all passed"
}

# check NAME COMMAND...
check() {
  say "$1"
  "${@:2}" || failed+=("$1")
}

# What .pre-commit-config.yaml runs, and catkin_lint, whose warnings count too.
run_linters() {
  check "catkin_lint" lint_package
  if [ -x "$venv/bin/mypy" ]; then
    check "ruff check" "$venv/bin/ruff" check --quiet .
    check "ruff format" "$venv/bin/ruff" format --quiet --check .
    check "mypy" "$venv/bin/mypy"
  else
    say "ruff and mypy NOT run: they need Python 3.11, this is $("$venv/bin/python" --version)"
  fi
}

lint_package() (
  source_workspace
  catkin_lint -W1 --strict --offline "$root"
)

# On Python 3.8 the code has to run, but its numbers need no second proof. In the background, as pip waits for the network.
begin_smoke38() {
  [ -n "$python38" ] || return 0
  smoke38_log=$(mktemp)
  smoke38 >"$smoke38_log" 2>&1 </dev/null &
  smoke38_job=$!
  trap 'kill "$smoke38_job" 2>/dev/null || true; rm -f "$smoke38_log"' EXIT
}

smoke38() {
  ensure_venv "$venv38" "$python38" '' requirements.txt requirements-test.txt
  env -u PYTHONPATH "$venv38/bin/python" -m pytest -p no:cacheprovider test/smoke
}

end_smoke38() {
  if [ -z "$python38" ]; then
    say "Python 3.8 NOT checked: none found (python3.8 on PATH, \$PYTHON38, ~/.pyenv/versions/3.8*)"
    return
  fi
  wait "$smoke38_job" || failed+=("Python 3.8")
  say "test/smoke on Python 3.8:"
  cat "$smoke38_log"
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
