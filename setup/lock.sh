#!/usr/bin/env bash
# Pins requirements*.in for every supported Python together; existing pins stay, unless --upgrade is given.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
for name in requirements requirements-dev; do
    .venv/bin/python -m uv pip compile --quiet --universal --fork-strategy fewest --python-version 3.11 \
        --no-emit-index-url --custom-compile-command "make lock" --output-file $name.txt "$@" $name.in
done
