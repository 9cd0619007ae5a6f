// One file of PoCL's kernel folder (driver_cache.hpp): what is known of it, and a line of the list.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <sys/stat.h>

namespace penumbra::opencl {

struct CachedFile {
    std::uint64_t hash = 0, bytes = 0;
    std::int64_t modified_ns = 0, changed_ns = 0; // as stat says, since 1970
};

std::int64_t nanoseconds(const timespec& time);

// All of a regular file; nothing of what is none, or cannot be read. Links are not followed.
std::optional<std::string> content_of(const std::string& path);

CachedFile cached_file(std::string_view content, const struct stat& status);
std::uint64_t hash_of(std::string_view bytes);

// Whether a file of which nothing is known looks like what its name says, and whole: LLVM's bitcode, or a library up to its last section.
bool looks_sound(const std::string& path);

// "HASH BYTES MODIFIED CHANGED PATH", and back; nothing for a line that makes no sense.
std::string line_of(const std::string& path, const CachedFile& file);
std::optional<std::pair<std::string, CachedFile>> file_of_line(const std::string& line);

} // namespace penumbra::opencl
