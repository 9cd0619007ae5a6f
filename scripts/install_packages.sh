#!/usr/bin/env bash
# Installs what packages.txt lists and this machine lacks, with apt. Leaves apt alone when nothing is missing; without apt it says so and
# leaves the rest to the build.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() {
    echo "install_packages: $1" >&2
    exit 1
}

wanted=$(sed -e 's/#.*//' -e '/^[[:space:]]*$/d' packages.txt)
if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    echo "install_packages: no apt here, so nothing is installed; what is needed stands in packages.txt under its Debian names" >&2
    exit 0
fi

missing=()
for package in $wanted; do
    state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
    [ "$state" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "run as root, or install yourself: apt-get install --no-install-recommends ${missing[*]}"
    as_root=(sudo)
fi
echo "Installing ${#missing[@]} packages: ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
