#!/usr/bin/env bash
# Runs clang-tidy, with the checks of .clang-tidy, over the library, the server and the command. Exits 1 when it finds anything.
#     scripts/tidy.sh [FILE...]        without files: all of host/, server/ and clients/cli/, in the batches of the build
set -euo pipefail
cd "$(dirname "$0")/.."

# A compile database for clang: GCC's precompiled headers mean nothing to it. Warnings are GCC's to give: clang has some more. Of the build's own
# files only the database is read, its batches, and the two that are made.
folder=build/tidy
configure() {
    cmake --preset release -B "$folder" -DCMAKE_CXX_COMPILER=clang++-15 -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DPENUMBRA_WARNINGS_AS_ERRORS=OFF \
        -DPENUMBRA_TESTS=OFF -DPENUMBRA_BENCH=OFF "$@" >/dev/null
}
if [ $# -gt 0 ]; then
    configure -DPENUMBRA_TOGETHER=OFF
    files=("$@")
    checks=()
else
    configure -DPENUMBRA_TOGETHER=ON
    cmake --build "$folder" --target penumbra_kernels_embedded server/page.cpp >/dev/null
    # Headers take most of the time, of ten files in a batch once. A batch includes .cpp files, as it has to.
    mapfile -t files < <(jq -r '.[].file' "$folder/compile_commands.json" | grep -E '\.cxx$|/(host|server|clients/cli)/' | sort -u)
    checks=(--checks=-bugprone-suspicious-include)
fi
printf '%s\0' "${files[@]}" | xargs -0 -P "$(nproc)" -n 1 nice clang-tidy-15 -p "$folder" --quiet "${checks[@]}" 2>/dev/null || {
    echo "tidy: something was found" >&2
    exit 1
}
echo "tidy: nothing found"
