#!/bin/sh
# Whether every function that docs/walk.md names is in the sources.
#
#     check_walk.sh SOURCE_FOLDER
set -eu
cd "$1"
missing=0
names=$(grep -E '^[0-9]+\. |^    ' docs/walk.md | grep -oE '`[A-Za-z_]+(::[A-Za-z_]+)*`' | tr -d '`' | sort -u)
[ -n "$names" ] || { echo "check_walk: docs/walk.md names nothing" >&2; exit 1; }
for name in $names; do
    grep -rqwE "${name##*::}" host server kernels --include=*.cpp --include=*.hpp --include=*.cl || { echo "check_walk: no $name in the sources" >&2; missing=1; }
done
exit $missing
