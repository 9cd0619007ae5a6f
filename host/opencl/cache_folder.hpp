// Where the library keeps what it may build again.
#pragma once

#include <string>

namespace penumbra::opencl {

// $PENUMBRA_CACHE_DIR, else $XDG_CACHE_HOME/penumbra, else $HOME/.cache/penumbra, else "": nothing is kept. Not necessarily there yet.
std::string cache_folder();

// Makes `path` (and what leads to it) with mode 0700 unless it is there. True when it is a folder of this user's, writable by nobody else
// (its content is loaded as code), that we can write to and execute from.
bool make_private_folder(const std::string& path);

// The same, in words: "" when it can be used, else what is wrong, to go behind its name: "is not a folder".
std::string unusable_private(const std::string& path);

// Of a folder that somebody else answers for: who may write there is his business.
std::string unusable(const std::string& path);

// "has 12288 bytes free, expected at least 4194304 (4.00 MiB)" for a folder on a disk without room for a few kernels; "" for others.
std::string lacks_room(const std::string& path);

} // namespace penumbra::opencl
