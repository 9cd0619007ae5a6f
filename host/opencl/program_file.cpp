#include "opencl/program_file.hpp"

#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace penumbra::opencl {
namespace {

// __extension__, for -Wpedantic, may stand before a typedef alone.
// NOLINTNEXTLINE(modernize-use-using)
__extension__ typedef unsigned __int128 uint128;

struct Header {
    char magic[8] = {'P', 'N', 'B', 'R', 'P', 'R', 'O', 'G'};
    std::uint32_t format = program_file_format;
    std::uint32_t reserved = 0;
    ProgramKey key = {};
    std::uint64_t bytes = 0;
    ProgramKey checksum = {};
};
static_assert(sizeof(Header) == 56, "the header has no padding");

// http://www.isthe.com/chongo/tech/comp/fnv/: offset basis and prime for 128 bits.
constexpr uint128 fnv_basis = (uint128{0x6c62272e07bb0142} << 64) | 0x62b821756295c58d;
constexpr uint128 fnv_prime = (uint128{1} << 88) | 0x13b;

uint128 fnv(uint128 hash, std::string_view bytes)
{
    for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * fnv_prime;
    return hash;
}

std::string file_name(const std::string& folder, const ProgramKey& key) { return folder + '/' + hexadecimal(key) + ".program"; }

ProgramKey checksum(const std::vector<unsigned char>& payload)
{
    return program_key({std::string_view(reinterpret_cast<const char*>(payload.data()), payload.size())});
}

bool write_all(int file, const void* data, std::size_t bytes)
{
    const char* at = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t written = write(file, at, bytes);
        if (written <= 0) return false;
        at += written;
        bytes -= static_cast<std::size_t>(written);
    }
    return true;
}

} // namespace

ProgramKey program_key(const std::vector<std::string_view>& parts)
{
    uint128 hash = fnv_basis;
    for (const std::string_view part : parts) hash = fnv(fnv(hash, std::to_string(part.size()) + ':'), part);
    return {static_cast<std::uint64_t>(hash >> 64), static_cast<std::uint64_t>(hash)};
}

std::string hexadecimal(const ProgramKey& key)
{
    char text[33];
    std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(key[0]), static_cast<unsigned long long>(key[1]));
    return text;
}

std::optional<std::vector<unsigned char>> read_program_file(const std::string& folder, const ProgramKey& key)
{
    std::ifstream file(file_name(folder, key), std::ios::binary | std::ios::ate);
    if (!file) return std::nullopt;
    const std::streamoff size = file.tellg();
    file.seekg(0);

    // The header must be the one that we would write for this program; only then is its length believed, and it must be the file's.
    Header header, expected;
    if (size < static_cast<std::streamoff>(sizeof header) || !file.read(reinterpret_cast<char*>(&header), sizeof header))
        return std::nullopt;
    if (std::memcmp(header.magic, expected.magic, sizeof header.magic) != 0 || header.format != expected.format || header.key != key) {
        return std::nullopt;
    }
    if (header.bytes == 0 || header.bytes != static_cast<std::uint64_t>(size) - sizeof header) return std::nullopt;

    std::vector<unsigned char> payload(header.bytes);
    if (!file.read(reinterpret_cast<char*>(payload.data()), static_cast<std::streamsize>(payload.size()))) return std::nullopt;
    if (checksum(payload) != header.checksum) return std::nullopt;
    return payload;
}

bool write_program_file(const std::string& folder, const ProgramKey& key, const std::vector<unsigned char>& binary)
{
    std::string temporary = folder + "/.program-XXXXXX";
    const int file = mkstemp(temporary.data());
    if (file < 0) return false;

    Header header;
    header.key = key;
    header.bytes = binary.size();
    header.checksum = checksum(binary);
    const bool written = write_all(file, &header, sizeof header) && write_all(file, binary.data(), binary.size());
    const bool closed = close(file) == 0;
    if (written && closed && std::rename(temporary.c_str(), file_name(folder, key).c_str()) == 0) return true;
    unlink(temporary.c_str());
    return false;
}

} // namespace penumbra::opencl
