#!/usr/bin/env bash
# Makes the workspace ready to use: a virtual environment in .venv with all packages that requirements*.txt pin, and the
# packages of src/ built into install/. It does only what is missing, so it may run before everything else, and may be
# interrupted at any time. `PYTHON=python3.12 make setup` chooses the interpreter.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
ROOT=$(pwd -P)
LOG=log/setup.log
readonly ROOT LOG

# The build inherits nothing from another ROS, another environment or the calling make.
unset PYTHONPATH PYTHONHOME VIRTUAL_ENV CONDA_PREFIX LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH COLCON_CURRENT_PREFIX MAKELEVEL MFLAGS
# Nor from the environment that this script makes, if install/setup.bash was sourced.
PATH=:$PATH:
PATH=${PATH//":$ROOT/.venv/bin:"/:}
PATH=${PATH#:}
PATH=${PATH%:}

fail() {
    printf 'setup: %s\n' "$*" >&2
    exit 1
}

# stage <title> <command...>: run a command, print one line with its time, and append its output to the log.
stage() {
    local name=$1 start=$SECONDS status=0
    shift
    [[ -n ${log_started:-} ]] || : >"$LOG"
    log_started=yes
    printf 'setup: %s ... ' "$name"
    printf '\n=== %s\n' "$name" >>"$LOG"
    set +e # a subshell in a condition would ignore its own -e
    (
        set -e
        "$@"
    ) >>"$LOG" 2>&1
    status=$?
    set -e
    if ((status != 0)); then
        printf 'failed\n'
        tail -n 30 "$LOG" >&2
        fail "\"$name\" failed; the end of $LOG is above. Correct the cause and run make setup again."
    fi
    printf '%d s\n' $((SECONDS - start))
}

# One line that changes when the workspace moves, or when one of the given files or folders changes.
fingerprint() {
    { echo "$ROOT"; find "$@" -type f -print0 | sort -z | xargs -0 sha256sum; } | sha256sum
}

environment_fingerprint() {
    readlink -f .venv/bin/python || true
    fingerprint requirements.txt requirements-dev.txt setup
}

# Python sources and configuration files are linked, not copied: a Python package is built again when its description
# changes, or when a configuration file is added or removed.
package_fingerprint() {
    local source
    source=$(source_folder "$1")
    cat .venv/.stamp
    if [[ -e $source/setup.py ]]; then
        [[ ! -e $source/config ]] || find -L "$source/config" -type f | sort
        fingerprint "$source"/{package.xml,setup.py,setup.cfg,resource}
    else
        fingerprint "$source"
    fi
}

# Packages of ROS that no wheel has are in setup/, where a plain colcon build does not look (setup/COLCON_IGNORE).
source_folder() {
    if [[ -e src/$1 ]]; then
        echo "src/$1"
    elif [[ -e setup/$1 && ! -e .venv/share/ament_index/resource_index/packages/$1 ]]; then
        echo "setup/$1"
    fi
}

supported() {
    "$1" -Ic 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null
}

find_python() {
    local candidate
    if [[ -n ${PYTHON:-} ]]; then
        supported "$PYTHON" || fail "PYTHON=$PYTHON is not a Python 3.11, 3.12 or 3.13."
        echo "$PYTHON"
        return
    fi
    for candidate in python3 python3.13 python3.12 python3.11; do
        if supported "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    fail "no Python 3.11, 3.12 or 3.13 found; install one with: sudo apt install python3-venv python3-dev" \
        "(where that is another version, get one elsewhere and name it: PYTHON=/path/to/python3.12 make setup)"
}

check_system() {
    local python=$1 missing=() tool apt_python
    [[ $(uname -sm) == "Linux x86_64" ]] || fail "the ROS 2 wheels exist for Linux x86_64 only; this is $(uname -sm)."
    [[ $ROOT != *:* ]] || fail "the folder $ROOT has a colon in its name, which no search path can hold; move it."
    for tool in gcc g++ cmake make; do
        command -v "$tool" >/dev/null || missing+=("$tool")
    done
    apt_python=$("$python" -Ic 'import sys; print("python%d.%d" % sys.version_info[:2])')
    [[ $python != python3 ]] || apt_python=python3
    "$python" -Ic 'import ensurepip, venv' 2>/dev/null || missing+=("$apt_python-venv")
    "$python" -Ic 'import os, sys, sysconfig; sys.exit(not os.path.exists(sysconfig.get_path("include") + "/Python.h"))' ||
        missing+=("$apt_python-dev")
    ((${#missing[@]} == 0)) || fail "something is missing; install it with: sudo apt install ${missing[*]}"
}

create_environment() {
    rm -f .venv/.stamp # first: after an interruption, no stamp may be left in an incomplete folder
    rm -rf .venv build install
    "$1" -m venv .venv
    # uv installs these wheels in a sixth of pip's time; if it fails, pip installs them.
    .venv/bin/python -m pip install --disable-pip-version-check -c requirements-dev.txt uv || true
    .venv/bin/python -m uv pip install --python .venv/bin/python \
        --system-certs --compile-bytecode -r requirements.txt -r requirements-dev.txt ||
        .venv/bin/python -m pip install --disable-pip-version-check -r requirements.txt -r requirements-dev.txt
    local shell site_packages
    for shell in sh bash zsh; do
        cp setup/local_setup.sh ".venv/local_setup.$shell"
    done
    site_packages=$(.venv/bin/python -Ic 'import sysconfig; print(sysconfig.get_path("purelib"))')
    cp setup/relform_workspace.py "$site_packages/"
    [[ -e .venv/bin/ros2 ]] || cp setup/ros2 .venv/bin/
    .venv/bin/register-python-argcomplete ros2 >.venv/ros2-completion.sh
    # The underscore sorts it before the .pth file of the wheels.
    echo 'import relform_workspace' >"$site_packages/_relform_workspace.pth"
}

# setuptools names the interpreter by its absolute path, which the kernel does not accept if it is long or has a space.
# This head, valid as sh and as Python, finds the interpreter by a relative path, so the folder may move.
write_interpreter_line() {
    local rest
    rest=$(sed '1{/^#!.*python/d}' "$1")
    cat >"$1" <<'HEAD'
#!/bin/sh
'''exec' "$(dirname "$(realpath "$0")")/../../../../.venv/bin/python" "$0" "$@"
' '''
HEAD
    printf '%s\n' "$rest" >>"$1"
}

build_packages() {
    local package executable jobs
    local -A fingerprints # before the build: what changes meanwhile is built the next time
    jobs=$(nproc)
    export VIRTUAL_ENV=$ROOT/.venv AMENT_PREFIX_PATH=$ROOT/.venv CMAKE_PREFIX_PATH=$ROOT/.venv
    export PATH=$ROOT/.venv/bin:$PATH MAKEFLAGS=-j$jobs
    for package in "$@"; do
        fingerprints[$package]=$(package_fingerprint "$package")
        rm -f "install/$package/.stamp"
        rm -rf "build/$package" "install/$package"
    done
    .venv/bin/python -m colcon build --base-paths src setup/tf2_msgs --packages-select "$@" --symlink-install \
        --cmake-args "-DCMAKE_PROJECT_INCLUDE=$ROOT/setup/ros_wheels_fix.cmake"
    # The scripts that users source: colcon does not quote two paths. The scripts also ask Python which variables lack our
    # folders. It must start without relform_workspace.py (-S), which adds them.
    sed -i 's|(\$_colcon_python_executable |("$_colcon_python_executable" -S |' install/local_setup.*sh
    sed -i 's|^\(_colcon_prefix_chain_sh_COLCON_CURRENT_PREFIX\)=\([^"]*\)$|\1="\2"|' install/setup.sh
    for package in "$@"; do
        for executable in "install/$package/lib/$package"/*; do
            [[ ! -f $executable ]] || write_interpreter_line "$executable"
        done
        printf '%s\n' "${fingerprints[$package]}" >"install/$package/.stamp"
    done
}

trap 'printf "\nsetup: interrupted; the next run continues from here.\n" >&2; exit 130' INT
# Only one set-up runs in a folder; a second waits, and then has nothing to do.
exec 9<setup/setup.sh
flock --nonblock 9 || {
    echo "setup: waiting for another set-up of this folder"
    flock 9
}

mkdir -p log
if [[ $(environment_fingerprint) != "$(cat .venv/.stamp 2>/dev/null)" ]]; then
    python=$(find_python)
    check_system "$python"
    stage "Python environment in .venv, $("$python" --version)" create_environment "$python"
    environment_fingerprint >.venv/.stamp
fi

for installed in install/{relform_*,tf2_msgs}; do
    package=$(basename "$installed")
    [[ -n $(source_folder "$package") ]] || rm -rf "install/$package" "build/$package"
done
stale=()
for manifest in {src,setup}/*/package.xml; do
    package=$(basename "$(dirname "$manifest")")
    [[ -n $(source_folder "$package") ]] || continue
    [[ $(package_fingerprint "$package") == "$(cat "install/$package/.stamp" 2>/dev/null)" ]] || stale+=("$package")
done
((${#stale[@]} == 0)) || stage "building ${stale[*]}" build_packages "${stale[@]}"
