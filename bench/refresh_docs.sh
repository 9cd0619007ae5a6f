#!/bin/sh
# Writes the tables of docs/*.md anew. A table stands between "<!-- table: COMMAND -->" and "<!-- end -->" and is what COMMAND prints.
# A guide's table is some rows and columns of its study's: sed and cut behind bench/table.sh.
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
            # A pipe has the status of its last command: one that printed nothing has failed too.
            lines = 0
            while ((command | getline line) > 0) { print line; lines++ }
            if (close(command) != 0 || lines == 0) { print "refresh_docs: failed: " command > "/dev/stderr"; exit 1 }
            skipping = 1
            next
        }
        /^<!-- end -->$/ { skipping = 0 }
        !skipping' "$page" > "$page.part"
    mv "$page.part" "$page"
done
