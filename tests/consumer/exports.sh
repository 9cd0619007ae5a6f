#!/bin/sh
# exports.sh LIBRARY: every symbol that LIBRARY defines for others is one of namespace penumbra, and of none of its inner namespaces.
set -eu
library=$1
symbols=$(nm -D --defined-only -C "$library" | sed -E 's/^[0-9a-f]* +[A-Za-z] //')
[ -n "$symbols" ] || { echo "$library exports nothing" >&2; exit 1; }

public='^((typeinfo|typeinfo name|vtable|VTT|guard variable) for )?penumbra::[A-Za-z_~]+(::[A-Za-z_~=]+)*(\[abi:[a-z0-9]+\])?(\(.*)?$'
inner='penumbra::(opencl|cli|test|\(anonymous namespace\))'
leaks=$(printf '%s\n' "$symbols" | grep -vE "$public" || true)
leaks="$leaks$(printf '%s\n' "$symbols" | grep -E "$inner" || true)"
if [ -n "$leaks" ]; then
    echo "not of the public interface:" >&2
    printf '%s\n' "$leaks" >&2
    exit 1
fi
printf '%s\n' "$symbols" | wc -l
