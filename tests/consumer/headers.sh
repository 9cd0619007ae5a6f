#!/bin/sh
# headers.sh CXX PREFIX: every installed header compiles on its own, without a warning.
set -eu
cxx=$1 prefix=$2
for header in "$prefix"/include/penumbra/*.hpp; do
    echo "$header"
    # shellcheck disable=SC2046
    echo "#include <penumbra/$(basename "$header")>" |
        "$cxx" -std=c++20 -x c++ -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror -fsyntax-only -I "$prefix/include" $(pkg-config --cflags Imath OpenCL cpp-httplib) -
done
