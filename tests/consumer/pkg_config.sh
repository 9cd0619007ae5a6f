#!/bin/sh
# pkg_config.sh CXX PREFIX LIBDIR EXAMPLES BUILD: compiles the first example with what pkg-config says, and runs it.
set -eu
cxx=$1 prefix=$2 libdir=$3 examples=$4 build=$5
mkdir -p "$build"
export PKG_CONFIG_PATH="$prefix/$libdir/pkgconfig"
pkg-config --modversion penumbra
# shellcheck disable=SC2046
"$cxx" -std=c++20 "$examples/01_library.cpp" $(pkg-config --cflags --libs penumbra) -o "$build/01_library"
LD_LIBRARY_PATH="$prefix/$libdir" "$examples/expect.sh" "$examples/01_library.cpp" "$build/01_library"
