#!/usr/bin/env bash
# Longer checks, by hand before a release or when an issue is declared resolved (about an hour on two cores): the tests marked
# long, odd inputs of every area and 200 synthetic robots for advise. bash scripts/test_long.sh [SEED]
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

bash "$root/scripts/setup.sh" --test
cd "$root"
use_loopback
source_workspace
seed=${1:-1}
"$venv/bin/python" -m pytest -m long -p no:cacheprovider test
"$venv/bin/python" test/fuzz/all.py --minutes 20 --seed "$seed"
"$venv/bin/python" test/benchmark/advice_robots.py
