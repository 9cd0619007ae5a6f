#!/bin/sh
# Compiles every specialisation of every kernel, as OpenCL C 1.2, warnings as errors, for two address models that differ from the host's.
#
#     compile_kernels.sh CLANG KERNELS_FOLDER LIST
#
# LIST is an executable that prints one specialisation a line: a file below KERNELS_FOLDER, then its -D options.
# Exits 1, after trying all of them, when any fails; the failing command's line is shown.
set -u
clang=$1
kernels=$2
list=$3

# spir64 stands for any device (generic OpenCL address spaces, no vector registers to lean on), amdgcn for a real GPU, the empty one for the
# host, which is what PoCL compiles for, with the header that PoCL 3.1 is given. A clang without a back end leaves that one out.
targets=
for target in spir64 amdgcn-amd-amdhsa; do
    if echo 'kernel void probe(global float* a) { a[get_global_id(0)] = 0.0f; }' |
        "$clang" -x cl -cl-std=CL1.2 -target "$target" -nogpulib -Xclang -finclude-default-header -fsyntax-only - 2>/dev/null; then
        targets="$targets $target"
    fi
done

lines=$("$list") || { echo "compile_kernels: $list failed" >&2; exit 1; }
[ -n "$lines" ] || { echo "compile_kernels: $list printed no specialisation" >&2; exit 1; }

# One line, all targets. The options are split at blanks; a value that holds one cannot be written in a specialisation either. -Wundef: a
# choice that common/choices.h does not name would count as 0.
compile='
    file=$1
    shift
    if [ ! -f "$kernels/$file" ]; then
        echo "compile_kernels: no kernel file $file below $kernels" >&2
        exit 1
    fi
    for target in host $targets; do
        if [ "$target" = host ]; then machine="-cl-no-stdinc -include opencl-c-base.h -include $kernels/common/builtins_pocl_31.clh"; else machine="-target $target -nogpulib -Xclang -finclude-default-header"; fi
        if ! "$clang" -x cl -cl-std=CL1.2 $machine -Wall -Wextra -Wundef -Werror -fsyntax-only -I "$kernels" "$@" "$kernels/$file"; then
            echo "compile_kernels: failed for $target: $file $*" >&2
            exit 1
        fi
    done
'
export clang kernels targets

# As many at a time as there are processors; all are tried, and one that fails makes xargs fail.
echo "$lines" | sed "s, *\$,," | xargs -P "$(getconf _NPROCESSORS_ONLN)" -L 1 sh -c "$compile" compile_kernels ||
    { echo "compile_kernels: some of $(echo "$lines" | wc -l) specialisations failed" >&2; exit 1; }
