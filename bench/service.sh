#!/usr/bin/env bash
# The service under load: time outside compute, masks a second beside the library's own, overload; kept scenes. CSV on standard output;
# bench/service_table.sh makes tables of it,
# docs/service_load.md has them.
#     bench/service.sh > out/bench/service.csv       about four minutes; needs a build as bench/run.sh does, wrk (Debian: apt install wrk),
#                                                    curl and jq
# BENCH_SECONDS: of each measurement (3). BENCH_RUNS: how often each is made (3).
set -euo pipefail
cd "$(dirname "$0")/.."
server=${PENUMBRA_SERVER:-build/release/server/penumbra-server}
library=${PENUMBRA_BENCH_SERVICE:-build/release/bench/penumbra_bench_service}
seconds=${BENCH_SECONDS:-3} runs=${BENCH_RUNS:-3} overload=72
for program in "$server" "$library"; do
    [ -x "$program" ] || { echo "bench/service.sh: $program is missing: build first (./check builds it)" >&2; exit 2; }
done
for program in wrk curl jq; do
    command -v "$program" > /dev/null || { echo "bench/service.sh: $program is missing: apt install $program" >&2; exit 2; }
done

folder=$(mktemp -d)
process=
trap '[ -z "$process" ] || kill "$process"; rm -rf "$folder"' EXIT

# start OPTION...: a service on a free port; sets process and url
start() {
    [ -z "$process" ] || { kill "$process"; wait "$process" || true; }
    : > "$folder/log" # or the last one's "ready" would be taken for this one's
    "$server" --port 0 "$@" 2>> "$folder/log" &
    process=$!
    for _ in $(seq 600); do
        grep -q '^ready$' "$folder/log" && break
        kill -0 "$process" || { cat "$folder/log" >&2; exit 1; }
        sleep 0.1
    done
    url=http://127.0.0.1:$(sed -n 's/^listening on .* port //p' "$folder/log")
}

memory() { awk -v what="$1:" '$1 == what { printf "%.1f", $2 / 1024 }' "/proc/$process/status"; } # MiB

form='multipart/form-data; boundary=penumbra-bench'
png=image/png pfm=image/x-portable-floatmap

# load NAME CLIENTS BODY TYPE ACCEPT PATH: one measurement, one row. A client's times are joined with the service's log by request id.
load() {
    local name=$1 clients=$2 body=$3 type=$4 accept=$5 path=$6
    rm -f "$folder"/times.*
    local from before
    from=$(stat -c %s "$folder/log") before=$(memory VmRSS)
    BENCH_BODY=$body BENCH_TYPE=$type BENCH_ACCEPT=$accept BENCH_OUT=$folder/times \
        wrk -t "$clients" -c "$clients" -d "${seconds}s" --timeout 30s -s bench/service/load.lua "$url$path" > "$folder/wrk"
    sleep 0.2 # what wrk left behind is finished
    sed -n 's/^  .* requests in \([0-9.]*\)s.*/\1/p' "$folder/wrk" > "$folder/taken"
    tail -c "+$((from + 1))" "$folder/log" | grep '"request_id":"bench-' |
        jq -r '[.request_id, .status, .compute_ms // 0, .queue_ms // 0] | @tsv' > "$folder/served"
    local row
    row=$(awk -f bench/service/join.awk taken="$(cat "$folder/taken")" "$folder/served" "$folder"/times.*)
    echo "$name,$run,$clients,$row,$before,$(memory VmRSS),$(memory VmHWM)"
}

# bits PATH ACCEPT BODY TYPE FILE: fails when the service's mask has other bytes than FILE
bits() {
    curl -sS --fail-with-body -H "Accept: $2" -H "Content-Type: $4" --data-binary "@$3" "$url$1" -o "$folder/mask"
    cmp "$folder/mask" "$5" >&2 || { echo "bench/service.sh: the mask of $1 is not the library's" >&2; exit 1; }
}

# Holds every place but none computes: requests whose bodies do not come.
hold_places() {
    exec {held}<> "/dev/tcp/127.0.0.1/${url##*:}"
    printf 'POST /v1/masks HTTP/1.1\r\nHost: localhost\r\nContent-Type: %s\r\nContent-Length: 100000\r\n\r\n' "$form" >&"$held"
    sleep 0.2
}

echo "# $(date -u +%F), $(nproc) cores of $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), load $(cut -d' ' -f1 /proc/loadavg)"
"$library" "$folder" 0.1 | grep '^#'
echo 'case,run,clients,seconds,masks,masks_per_s,total_min,total_p50,total_p99,compute_min,compute_p50,outside_min,outside_p50,outside_p99,refused,refused_p50,refused_p99,rss_before,rss_after,rss_peak'

printf '{"light": {"half_u": [0.5%%06d, 0, 0]}}' > "$folder/light.body"
printf '{}' > "$folder/same.body"
for run in $(seq "$runs"); do
    "$library" "$folder" "$seconds" | sed -n "s/^\(library[^,]*\),/\1,$run,/p"
    start
    bits /v1/masks $png "$folder/exr.body" "$form" "$folder/library.png"
    bits /v1/masks $pfm "$folder/pfm.body" "$form" "$folder/library.pfm"
    bits /v1/masks $png "$folder/heavy.body" "$form" "$folder/heavy.png"
    for clients in 1 2; do
        load 'EXR to PNG' $clients "$folder/exr.body" "$form" $png /v1/masks
        load 'PFM to PFM' $clients "$folder/pfm.body" "$form" $pfm /v1/masks
        load 'EXR to PNG; 512 texels' $clients "$folder/heavy.body" "$form" $png /v1/masks
    done

    scene=$(curl -sS --fail-with-body -H "Content-Type: $form" --data-binary "@$folder/exr.body" "$url/v1/scenes" | jq -r .id)
    bits "/v1/scenes/$scene/masks" $png "$folder/same.body" application/json "$folder/library.png"
    for clients in 1 2; do
        load 'kept scene; another light each' $clients "$folder/light.body" application/json $png "/v1/scenes/$scene/masks"
        load 'kept scene; unchanged' $clients "$folder/same.body" application/json $png "/v1/scenes/$scene/masks"
    done

    start
    BENCH_ANSWERS=wait load 'overload; Retry-After heeded' $overload "$folder/exr.body" "$form" $png /v1/masks
    BENCH_ANSWERS=now load 'overload; asked again at once' $overload "$folder/exr.body" "$form" $png /v1/masks

    start --slots 1 --queue 0
    hold_places
    BENCH_ANSWERS=now load 'refused' 1 "$folder/exr.body" "$form" $png /v1/masks
    exec {held}>&-
done
