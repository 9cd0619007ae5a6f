#!/bin/sh
# Tables of bench/service.sh's CSV: bench/service_table.sh latency|rate|overload|memory [FILE.csv]. Ranges are over its runs.
set -eu
file=${2:-out/bench/service.csv}
case ${1:-} in latency | rate | overload | memory) ;; *) echo "usage: $0 latency|rate|overload|memory [FILE.csv]" >&2; exit 2 ;; esac
[ -r "$file" ] || { echo "$0: $file is missing: bench/service.sh > $file" >&2; exit 2; }
sed -n 's/^# //p' "$file" | paste -sd ';' | sed 's/;/; /; s/.*/*&*\n/'
awk -F, -v table="$1" '
    function range(column, digits,    name, f) {
        name = key SUBSEP column
        if (!(name in low)) return "-"
        f = "%." digits "f"
        return low[name] == high[name] ? sprintf(f, low[name]) : sprintf(f " to " f, low[name], high[name])
    }
    /^#/ { next }
    !header { for (i = 1; i <= NF; ++i) column[i] = $i; header = 1; next }
    {
        key = $1 SUBSEP $3
        if (!(key in seen)) { seen[key] = 1; keys[++count] = key; name_of[key] = $1; clients[key] = $3 }
        for (i = 4; i <= NF; ++i) {
            if ($i == "") continue
            at = key SUBSEP column[i]
            if (!(at in low) || $i + 0 < low[at]) low[at] = $i + 0
            if (!(at in high) || $i + 0 > high[at]) high[at] = $i + 0
        }
        # Beside the library in the same run, from as many threads.
        if ($1 ~ /^library/) library[$1, $2, $3] = $6
        base = "library" ($1 ~ /512 texels/ ? "; 512 texels" : "")
        if (!($1 ~ /^library/) && (base, $2, $3) in library && library[base, $2, $3] > 0) {
            share = 100 * $6 / library[base, $2, $3]
            at = key SUBSEP "share"
            if (!(at in low) || share < low[at]) low[at] = share
            if (!(at in high) || share > high[at]) high[at] = share
        }
    }
    END {
        if (table == "latency") {
            print "| one client at a time | outside compute, ms: least | median | 99 % | compute, ms: median | total, ms: median | 99 % | mask |"
            print "| --- | --- | --- | --- | --- | --- | --- | --- |"
        } else if (table == "rate") {
            print "| | clients or threads | masks a second | of the library, % |"
            print "| --- | --- | --- | --- |"
        } else if (table == "overload") {
            print "| | clients | masks a second | accepted, ms: median | 99 % | refused, in all | refused, ms: median | 99 % |"
            print "| --- | --- | --- | --- | --- | --- | --- | --- |"
        } else {
            print "| | clients | MiB resident before | after | peak |"
            print "| --- | --- | --- | --- | --- |"
        }
        for (k = 1; k <= count; ++k) {
            key = keys[k]; name = name_of[key]
            library_row = name ~ /^library/; over = name ~ /^overload/ || name == "refused"
            if (table == "latency" && !library_row && !over && clients[key] == 1)
                printf "| %s | %s | %s | %s | %s | %s | %s | %s |\n", name, range("outside_min", 2), range("outside_p50", 2),
                    range("outside_p99", 2), range("compute_p50", 2), range("total_p50", 2), range("total_p99", 2),
                    name ~ /another light/ ? "another each" : "the library'"'"'s bits"
            if (table == "rate" && !over)
                printf "| %s | %s | %s | %s |\n", name, clients[key], range("masks_per_s", 0), range("share", 0)
            if (table == "overload" && over)
                printf "| %s | %s | %s | %s | %s | %s | %s | %s |\n", name, clients[key], range("masks_per_s", 0), range("total_p50", 0),
                    range("total_p99", 0), range("refused", 0), range("refused_p50", 2), range("refused_p99", 2)
            if (table == "memory" && !library_row)
                printf "| %s | %s | %s | %s | %s |\n", name, clients[key], range("rss_before", 0), range("rss_after", 0), range("rss_peak", 0)
        }
    }' "$file"
