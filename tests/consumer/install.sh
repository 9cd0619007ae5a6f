#!/bin/sh
# install.sh CMAKE BUILD PREFIX: installs the build into PREFIX, which is emptied first; nothing may stray from it.
set -eu
cmake=$1 build=$2 prefix=$3
rm -rf "$prefix"
"$cmake" --install "$build" --prefix "$prefix" >/dev/null

# The command works from there.
"$prefix/bin/penumbra" --version

# Nothing that is installed names the folders that it was built from.
if grep -rlI -e "$build" "$prefix"; then
    echo "the files above name the build folder $build" >&2
    exit 1
fi
