#!/bin/sh
# find_package.sh CMAKE CTEST CXX PREFIX EXAMPLES BUILD: builds EXAMPLES against what is installed in PREFIX, and runs their tests.
set -eu
cmake=$1 ctest=$2 cxx=$3 prefix=$4 examples=$5 build=$6
rm -rf "$build"
"$cmake" -S "$examples" -B "$build" -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0

# Not a copy that is installed elsewhere.
grep "^penumbra_DIR:PATH=$prefix/" "$build/CMakeCache.txt"

"$cmake" --build "$build"
"$ctest" --test-dir "$build" --output-on-failure
