#!/usr/bin/env bash
# Runs the tests with every supported Python that this machine has, one after the other, each in a clone of the last commit.
# Arguments go to pytest; PYTHONS="python3.12 /opt/python3.13/bin/python3" chooses the interpreters.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
ROOT=$(pwd -P)
clone=$(mktemp -d)
trap 'rm -rf "$clone"' EXIT

# The interpreter of a version: on the path, or one that pyenv keeps.
find_version() {
    local candidate
    for candidate in "python$1" "${PYENV_ROOT:-$HOME/.pyenv}/versions/$1".*/bin/python; do
        if "$candidate" -Ic "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$1')" 2>/dev/null; then
            echo "$candidate"
            return
        fi
    done
}

read -ra pythons <<<"${PYTHONS:-$(for version in 3.11 3.12 3.13; do find_version "$version"; done | xargs)}"
mkdir -p log
failed=0
for python in "${pythons[@]}"; do
    version=$("$python" -Ic 'import platform; print(platform.python_version())')
    report=$ROOT/log/test-python-$version.log
    rm -rf "$clone/relform"
    git clone --quiet "$ROOT" "$clone/relform"
    echo "Python $version: running, see log/test-python-$version.log"
    if make -C "$clone/relform" test PYTHON="$python" ARGS="$*" >"$report" 2>&1; then result=passed; else result=FAILED; failed=1; fi
    echo "Python $version: $result"
    grep -E '^=+ .* in [0-9.]+s|^[0-9]+ (passed|failed).* in ' "$report" | sed 's/^/  /' || true
done
exit "$failed"
