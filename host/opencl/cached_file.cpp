#include "opencl/cached_file.hpp"

#include <cstring>
#include <sstream>

#include <elf.h>
#include <fcntl.h>
#include <unistd.h>

namespace penumbra::opencl {

std::int64_t nanoseconds(const timespec& time) { return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec; }

std::optional<std::string> content_of(const std::string& path)
{
    const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (file < 0) return std::nullopt;
    struct stat status = {};
    std::optional<std::string> bytes;
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode)) {
        bytes.emplace(static_cast<std::size_t>(status.st_size), '\0');
        if (read(file, bytes->data(), bytes->size()) != static_cast<ssize_t>(bytes->size())) bytes.reset();
    }
    close(file);
    return bytes;
}

// 64 bits, eight bytes a step. Each step is one to one in the hash and in the word: files that differ in one word alone never meet.
std::uint64_t hash_of(std::string_view bytes)
{
    std::uint64_t hash = 0x9e3779b97f4a7c15 ^ bytes.size();
    const auto step = [&hash](std::uint64_t word) {
        hash = (hash ^ word) * 0xff51afd7ed558ccd; // odd
        hash ^= hash >> 32;
    };
    for (; bytes.size() >= 8; bytes.remove_prefix(8)) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes.data(), 8);
        step(word);
    }
    std::uint64_t rest = 0;
    std::memcpy(&rest, bytes.data(), bytes.size());
    step(rest);
    return hash;
}

bool looks_sound(const std::string& path)
{
    const auto bytes = content_of(path);
    if (!bytes) return false;
    if (path.ends_with(".bc")) return bytes->size() > 4 && bytes->size() % 4 == 0 && bytes->starts_with("BC\xC0\xDE");
    if (!path.ends_with(".so")) return true;
    Elf64_Ehdr header = {};
    if (bytes->size() < sizeof header) return false;
    std::memcpy(&header, bytes->data(), sizeof header);
    // The table of sections is a linker's last.
    return std::memcmp(header.e_ident, ELFMAG, SELFMAG) == 0 && header.e_ident[EI_CLASS] == ELFCLASS64 && header.e_shoff > 0 &&
           header.e_shoff <= bytes->size() && bytes->size() - header.e_shoff >= std::uint64_t{header.e_shnum} * header.e_shentsize;
}

CachedFile cached_file(std::string_view content, const struct stat& status)
{
    return {hash_of(content), content.size(), nanoseconds(status.st_mtim), nanoseconds(status.st_ctim)};
}

std::string line_of(const std::string& path, const CachedFile& file)
{
    std::ostringstream line;
    line << std::hex << file.hash << std::dec << ' ' << file.bytes << ' ' << file.modified_ns << ' ' << file.changed_ns << ' ' << path;
    return line.str();
}

std::optional<std::pair<std::string, CachedFile>> file_of_line(const std::string& line)
{
    std::istringstream words(line);
    CachedFile file;
    std::string path;
    if (!(words >> std::hex >> file.hash >> std::dec >> file.bytes >> file.modified_ns >> file.changed_ns >> path)) return std::nullopt;
    return std::pair(std::move(path), file);
}

} // namespace penumbra::opencl
