#!/bin/sh
# Whether every program that the tests before this one asked for is among those that the build compiles.
#
#     check_programs.sh LOG LIST
#
# LOG: what PENUMBRA_PROGRAM_LOG named; LIST: an executable that prints every specialisation. The log is emptied for the next run.
set -eu
log=$1
list=$2

[ -s "$log" ] || { echo "check_programs: no test has asked for a program: $log is empty" >&2; exit 1; }
asked=$(mktemp)
trap 'rm -f "$asked"' EXIT
sort -u "$log" >"$asked"
rm -f "$log"
missing=$("$list" | sort -u | comm -13 - "$asked")
if [ -n "$missing" ]; then
    echo "check_programs: not among what the build compiles:" >&2
    echo "$missing" >&2
    exit 1
fi
echo "$(wc -l <"$asked") programs were asked for, all among $("$list" | wc -l)"
