#!/bin/sh
# 05: the scene of 01 from a service: by curl, by the command line, and from Python (05_service.py).
#
# Expected: mean visibility 0.7503
#
# The programs are $PENUMBRA and $PENUMBRA_SERVER, or else `penumbra` and `penumbra-server` on the path; the Python package is in
# $PENUMBRA_PYTHONPATH, or else in clients/python.
set -eu
examples=$(cd "$(dirname "$0")" && pwd)
penumbra=${PENUMBRA:-penumbra}
server=${PENUMBRA_SERVER:-penumbra-server}
work=$(mktemp -d)
service=
trap 'kill $service 2>/dev/null || true; rm -rf "$work"' EXIT

# A service on a free port; its start-up block says which, and `ready` ends it.
: >"$work/log"
"$server" --port 0 2>"$work/log" &
service=$!
until grep -qx ready "$work/log"; do
    kill -0 "$service" || { cat "$work/log" >&2; exit 1; }
    sleep 0.1
done
url=http://127.0.0.1:$(sed -n 's/.*listening on .* port \([0-9]*\).*/\1/p' "$work/log")

# The scene has quads only, so there are no files to send along; `penumbra depth` makes the depth images that other scenes would have.
"$penumbra" depth "$examples/square.json" --out "$work/depth"
cd "$work/depth"
curl -sSf -H 'Accept: image/x-portable-floatmap' -F scene=@scene.json -F front.exr=@front.exr -F receiver.exr=@receiver.exr \
    "$url/v1/masks" -o "$work/curl.pfm"

# The same by the command line, which finds the files by itself, and here, without the service.
"$penumbra" mask scene.json -o "$work/remote.pfm" --server "$url"
"$penumbra" mask scene.json -o "$work/local.pfm"
cmp "$work/curl.pfm" "$work/remote.pfm"
cmp "$work/curl.pfm" "$work/local.pfm"

cd "$work"
PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=${PENUMBRA_PYTHONPATH:-$examples/../clients/python} python3 "$examples/05_service.py" "$url"
