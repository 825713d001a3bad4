#!/bin/sh
# SPDX-License-Identifier: MIT
# Install the packages that the given apt.txt files list and this machine lacks: setup.sh apt.txt cpp/apt.txt ...
# Where that needs a password, or is not Debian, it ends with the one command to type.
set -u

found() {
    case $1 in
        /*) [ -e "$1" ] || [ "$(uname)" = Darwin ] ;;
        ensurepip) [ -x .venv/bin/python ] || python3 -c 'import ensurepip' 2>/dev/null ;;
        *) command -v "$1" >/dev/null ;;
    esac
}

missing_debian='' missing_brew=''
for list; do
    [ -f "$list" ] || continue
    unless=$(sed -n 's/^# unless: //p' "$list")
    if [ -n "$unless" ] && found "$unless"; then continue; fi
    while read -r package _ program brew; do
        case $package in '' | '#') continue ;; esac
        if ! found "$program"; then
            missing_debian="$missing_debian $package"
            missing_brew="$missing_brew $brew"
        fi
    done <"$list"
done
[ -n "$missing_debian" ] || exit 0

if ! command -v apt-get >/dev/null; then
    echo "set-up: this machine lacks what the programs need; type: brew install$missing_brew" >&2
    exit 1
fi
if [ "$(id -u)" = 0 ]; then
    root=''
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    root='sudo -n'
else
    echo "set-up: this machine lacks what the programs need; type: sudo apt-get install -y --no-install-recommends$missing_debian" >&2
    exit 1
fi
mkdir -p build
echo "set-up: installing$missing_debian (a few minutes; see build/setup.log)"
if ! { $root apt-get update && $root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y --no-install-recommends $missing_debian; } >build/setup.log 2>&1; then
    tail -n 3 build/setup.log >&2
    echo "set-up: apt-get could not install$missing_debian; see build/setup.log" >&2
    exit 1
fi
