// Where the library keeps what it may build again.
#pragma once

#include <string>

namespace penumbra::opencl {

// $PENUMBRA_CACHE_DIR, else $XDG_CACHE_HOME/penumbra, else $HOME/.cache/penumbra, else "": nothing is kept. Not necessarily there yet.
std::string cache_folder();

// Makes `path` (and what leads to it) with mode 0700 unless it is there. True when it is a folder of this user's, writable by nobody else
// (its content is loaded as code), that we can write to and execute from.
bool make_private_folder(const std::string& path);

} // namespace penumbra::opencl
