#!/bin/sh
# SPDX-License-Identifier: MIT
# One make at a time in a tree, and after an interrupt no word but that of the make that was typed: alone.sh make ...
# What is below writes its errors to a pipe, whose reader shows nothing more once it is interrupted.
trap : INT
mkdir -p build || exit
exec 7>&1 9>>build/lock  # make itself may use 3 to 6
if command -v flock >/dev/null && ! flock -n 9; then
    echo 'make: another make is at work in this tree; waiting until it ends' >&2
    flock 9 || exit
fi
status=$(
    trap : INT
    {
        {
            trap : INT
            "$@" 2>&1 >&7 7>&- 8>&-
            echo $? >&8
        } | {
            trap : INT
            cat >&2
            trap '' INT
            cat >/dev/null
        }
    } 8>&1
)
if [ "$status" = 130 ]; then
    trap - INT
    kill -INT $$
fi
exit "${status:-1}"
