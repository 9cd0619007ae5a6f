# Writes OUTPUT, a C++ file that holds the bytes and media type of each of FILES (separated by "|", relative to ROOT).
string(REPLACE "|" ";" files "${FILES}")

set(media_html "text/html; charset=utf-8")
set(media_js "text/javascript; charset=utf-8")
set(media_css "text/css; charset=utf-8")
set(media_svg "image/svg+xml")

set(arrays "")
set(rows "")
set(count 0)
foreach(file IN LISTS files)
  get_filename_component(extension ${file} LAST_EXT)
  string(SUBSTRING ${extension} 1 -1 extension)
  if(NOT DEFINED media_${extension})
    message(FATAL_ERROR "${ROOT}/${file}: no media type is known for .${extension}; expected html, js, css or svg")
  endif()
  set(path "/page/${file}")
  if(file STREQUAL "index.html")
    set(path "/")
  endif()
  file(READ ${ROOT}/${file} bytes HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  # A final zero, so that an empty file has an array too; it is not counted.
  string(APPEND arrays "const unsigned char bytes_${count}[] = {${bytes}0};\n")
  string(APPEND rows
    "    {\"${path}\", \"${media_${extension}}\", {reinterpret_cast<const char*>(bytes_${count}), sizeof(bytes_${count}) - 1}},\n")
  math(EXPR count "${count} + 1")
endforeach()

file(WRITE ${OUTPUT} "// Made from clients/web/ by cmake/embed_page.cmake.
#include \"http/page.hpp\"

namespace penumbra::server {
namespace {

${arrays}
const Asset assets[] = {
${rows}};

} // namespace

std::span<const Asset> page_assets() { return assets; }

} // namespace penumbra::server
")
