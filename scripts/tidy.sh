#!/usr/bin/env bash
# Runs clang-tidy, with the checks of .clang-tidy, over the library, the server and the command. Exits 1 when it finds anything.
#     scripts/tidy.sh [FILE...]        without files: all of host/, server/ and clients/cli/
set -euo pipefail
cd "$(dirname "$0")/.."

# A compile database for clang: GCC's precompiled headers mean nothing to it. Of the build's own files only the database is read.
folder=build/tidy
cmake --preset release -B "$folder" -DCMAKE_CXX_COMPILER=clang++-15 -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DPENUMBRA_TOGETHER=OFF -DPENUMBRA_TESTS=OFF -DPENUMBRA_BENCH=OFF >/dev/null

if [ $# -gt 0 ]; then
    files=("$@")
else
    mapfile -t files < <(find host server clients/cli -name '*.cpp' | sort)
fi
printf '%s\0' "${files[@]}" | xargs -0 -P "$(nproc)" -n 4 clang-tidy-15 -p "$folder" --quiet 2>/dev/null
echo "tidy: ${#files[@]} files"
