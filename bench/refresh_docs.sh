#!/bin/sh
# Writes the tables of docs/*.md anew. A table stands between "<!-- table: COMMAND -->" and "<!-- end -->" and is what COMMAND prints.
#     bench/refresh_docs.sh [PAGE...]      all pages without arguments
# Run bench/run.sh first.
set -eu
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- docs/*.md
for page in "$@"; do
    awk '
        /^<!-- table: .* -->$/ {
            print
            command = $0
            sub(/^<!-- table: /, "", command)
            sub(/ -->$/, "", command)
            while ((command | getline line) > 0) print line
            if (close(command) != 0) { print "refresh_docs: failed: " command > "/dev/stderr"; exit 1 }
            skipping = 1
            next
        }
        /^<!-- end -->$/ { skipping = 0 }
        !skipping' "$page" > "$page.part"
    mv "$page.part" "$page"
done
