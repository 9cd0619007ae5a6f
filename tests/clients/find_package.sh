#!/bin/sh
# find_package.sh CMAKE CXX PREFIX SOURCE BUILD DOCS: builds SOURCE, and the C++ example of DOCS, against the client that is
# installed in PREFIX, and runs it.
set -eu
cmake=$1 cxx=$2 prefix=$3 source=$4 build=$5 docs=$6
rm -rf "$build"
mkdir -p "$build"
sed -n '/^```cpp/,/^```/p' "$docs" | sed '/^```/d' >"$build/docs.cpp"
grep -q 'int main' "$build/docs.cpp"
"$cmake" -S "$source" -B "$build" -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0
grep "^penumbra_client_DIR:PATH=$prefix/" "$build/CMakeCache.txt" # not a copy that is installed elsewhere
"$cmake" --build "$build"
if ldd "$build/consumer" | grep libpenumbra; then
    echo "the client needs the penumbra library" >&2
    exit 1
fi
[ "$("$build/consumer" http://127.0.0.1:1)" = connect ]
