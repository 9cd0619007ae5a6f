// Built programs on disk, one file each: `<folder>/<key>.program`.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra::opencl {

// 128 bits: no two programs meet by chance. Not proof against an attacker: the folder is private.
using ProgramKey = std::array<std::uint64_t, 2>;

// FNV-1a, 128 bits, over all parts, each after its length so that ("ab", "c") and ("a", "bc") differ.
ProgramKey program_key(const std::vector<std::string_view>& parts);
std::string hexadecimal(const ProgramKey& key);

// Raised whenever the file's layout, or what is hashed into its key, changes.
constexpr std::uint32_t program_file_format = 1;

// Layout, in the machine's byte order: magic[8], format u32, 0 u32, key u64[2], payload bytes u64, FNV-1a of the payload u64[2], payload.

// Nothing when there is no such file, or it is truncated, corrupted, of another format, or of another program. A driver may abort the
// process on a damaged binary, so every byte is covered by the checksum.
std::optional<std::vector<unsigned char>> read_program_file(const std::string& folder, const ProgramKey& key);

// Writes a temporary file beside it and renames that, so that readers see all or nothing. False when it cannot be written.
bool write_program_file(const std::string& folder, const ProgramKey& key, const std::vector<unsigned char>& binary);

} // namespace penumbra::opencl
