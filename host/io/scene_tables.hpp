// The scene file's description as text that is checked in: tables of docs/scene_file.md, lists of file places for the clients.
#pragma once

#include <string>
#include <string_view>

namespace penumbra {

// The document with the tables of its blocks written anew. A block stands between the lines "<!-- keys of NAME -->" (or "kinds of") and
// "<!-- end -->", NAME being an object's. Throws usage for a name that there is not and for a block without an end.
std::string with_tables(std::string_view document);

// clients/cpp/include/penumbra/client/file_places.hpp and clients/python/penumbra_client/file_places.py.
std::string cpp_file_places();
std::string python_file_places();

} // namespace penumbra
