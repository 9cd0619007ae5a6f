# Writes OUTPUT, a C++ file that holds the bytes of each of FILES (separated by "|", relative to ROOT).
string(REPLACE "|" ";" files "${FILES}")

set(arrays "")
set(rows "")
set(count 0)
foreach(file IN LISTS files)
  file(READ ${ROOT}/${file} bytes HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  # A final zero, so that an empty file has an array too; it is not counted.
  string(APPEND arrays "const unsigned char bytes_${count}[] = {${bytes}0};\n")
  string(APPEND rows "    {\"${file}\", {reinterpret_cast<const char*>(bytes_${count}), sizeof(bytes_${count}) - 1}},\n")
  math(EXPR count "${count} + 1")
endforeach()

file(WRITE ${OUTPUT} "// Made from kernels/ by cmake/embed_kernels.cmake.
#include \"opencl/kernel_files.hpp\"

namespace penumbra::opencl {
namespace {

${arrays}
const KernelFile files[] = {
${rows}    {\"\", \"\"}};

} // namespace

std::span<const KernelFile> kernel_files()
{
    return {files, ${count}};
}

} // namespace penumbra::opencl
")
