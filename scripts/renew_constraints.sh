#!/usr/bin/env bash
# Writes constraints/python3.8.txt and python3.11.txt anew: the newest versions of all libraries that the requirements files
# allow and that each Python can have as wheels. Then run scripts/test.sh, and look at what changes in `git diff`.
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

main() {
  cd "$root"
  tools=$(mktemp -d)
  trap 'rm -rf "$tools"' EXIT
  python3 -m venv "$tools"
  # uv resolves for a Python that need not be installed here
  "$tools/bin/python" -m pip install --quiet --disable-pip-version-check uv
  renew 3.8.10 requirements.txt requirements-test.txt                          # Ubuntu 20.04's
  renew 3.11.2 requirements.txt requirements-test.txt requirements-lint.txt requirements-docs.txt    # Debian 12's
}

# renew PYTHON REQUIREMENTS...
renew() {
  local version=${1%.*}
  local file=constraints/python$version.txt
  mkdir -p constraints
  {
    echo "# The versions that scripts/setup.sh installs for Python $version. Made by scripts/renew_constraints.sh; not to be edited."
    "$tools/bin/uv" pip compile --quiet --no-header --no-annotate --python-version "$1" \
      --python-platform x86_64-manylinux_2_28 --only-binary :all: "${@:2}"
  } > "$tools/new"
  grep -v '^--' "$tools/new" > "$file"
  say "$file: $(grep -c == "$file") libraries"
}

main
