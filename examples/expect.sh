#!/bin/sh
# expect.sh EXAMPLE COMMAND...: runs COMMAND, which is to exit with 0 and to print, as its last line, what EXAMPLE's header expects.
set -eu
expected=$(sed -n 's/^\(#\|\/\/\) Expected: //p' "$1")
[ -n "$expected" ] || { echo "$1: has no line \"Expected: ...\"" >&2; exit 1; }
shift
printed=$("$@") || { echo "$1 failed" >&2; exit 1; }
echo "$printed"
last=$(printf '%s\n' "$printed" | tail -n 1)
[ "$last" = "$expected" ] || { echo "expected: $expected" >&2; exit 1; }
