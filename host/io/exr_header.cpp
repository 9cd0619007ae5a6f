#include "io/exr_header.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

// Each chunk has an entry of 8 bytes in the file's table, and no compression puts more than 256 rows into a chunk.
constexpr std::uint64_t bytes_per_chunk = 8, rows_per_chunk = 256;

// More pixels a byte than any of the compressions reach (deflate 1032, and less than 64 times that with the run lengths of DWA before it).
constexpr std::uint64_t pixels_per_byte = 65536;

// Of a part. Renderers write some tens.
constexpr std::size_t most_channels = 1024;

std::uint32_t little_endian(std::span<const std::byte> bytes)
{
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | std::to_integer<std::uint32_t>(bytes[i]);
    return value;
}

std::int32_t integer(std::span<const std::byte> bytes) { return static_cast<std::int32_t>(little_endian(bytes)); }

// The text up to the next 0, which is taken off with it; nothing when there is no 0.
std::optional<std::string_view> take_name(std::span<const std::byte>& rest)
{
    const std::string_view text(reinterpret_cast<const char*>(rest.data()), rest.size());
    const std::size_t length = text.find('\0');
    if (length == std::string_view::npos) return {};
    rest = rest.subspan(length + 1);
    return text.substr(0, length);
}

// Attribute types of one size. OpenEXR reads that many bytes whatever the attribute says, so after another size it would take the middle of
// something for an attribute, and allocate by what it finds there.
struct Sized {
    std::string_view type;
    std::size_t size;
};
constexpr std::array<Sized, 24> sized_types{{{"box2f", 16},
                                             {"box2i", 16},
                                             {"chromaticities", 32},
                                             {"compression", 1},
                                             {"deepImageState", 1},
                                             {"double", 8},
                                             {"envmap", 1},
                                             {"float", 4},
                                             {"int", 4},
                                             {"keycode", 28},
                                             {"lineOrder", 1},
                                             {"m33d", 72},
                                             {"m33f", 36},
                                             {"m44d", 128},
                                             {"m44f", 64},
                                             {"rational", 8},
                                             {"tiledesc", 9},
                                             {"timecode", 8},
                                             {"v2d", 16},
                                             {"v2f", 8},
                                             {"v2i", 8},
                                             {"v3d", 24},
                                             {"v3f", 12},
                                             {"v3i", 12}}};

// Whether OpenEXR will read exactly this value. Of the other types it reads what the attribute says.
bool has_its_size(std::string_view type, std::span<const std::byte> value)
{
    if (const auto sized = std::ranges::find(sized_types, type, &Sized::type); sized != sized_types.end())
        return value.size() == sized->size;
    if (type == "preview") {
        if (value.size() < 8) return false;
        const std::uint64_t pixels = std::uint64_t{little_endian(value)} * little_endian(value.subspan(4));
        return (value.size() - 8) % 4 == 0 && pixels == (value.size() - 8) / 4;
    }
    if (type == "chlist") {
        while (const auto name = take_name(value)) {
            if (name->empty()) return value.empty();
            if (value.size() < 16) return false;
            value = value.subspan(16);
        }
        return false;
    }
    return true;
}

class HeaderReader {
public:
    HeaderReader(std::span<const std::byte> exr, std::string_view where, std::uint64_t max_samples)
        : rest_(exr), where_(where), file_size_(exr.size()), max_samples_(max_samples)
    {
    }

    // Magic, version and flags; then for each part attributes up to an empty name; several parts end in one more.
    void check()
    {
        take(4);
        const bool several_parts = (little_endian(take(4)) & 0x1000) != 0;
        do {
            while (check_attribute()) {
            }
        } while (several_parts && !at_end_of_parts());
    }

private:
    Error broken(const std::string& what) const
    {
        return {ErrorCode::invalid_input, std::string(where_) + " is truncated or broken: " + what};
    }

    std::span<const std::byte> take(std::size_t count)
    {
        if (rest_.size() < count) throw broken("its EXR header has no end");
        const auto taken = rest_.first(count);
        rest_ = rest_.subspan(count);
        return taken;
    }

    std::string_view name()
    {
        const std::optional<std::string_view> found = take_name(rest_);
        if (!found) throw broken("its EXR header has no end");
        return *found;
    }

    bool at_end_of_parts() const { return rest_.empty() || rest_.front() == std::byte{0}; }

    // False at the end of a part.
    bool check_attribute()
    {
        const std::string_view attribute = name();
        if (attribute.empty()) return false;
        const std::string_view type = name();
        const std::span<const std::byte> value = take(little_endian(take(4)));
        if (!has_its_size(type, value))
            throw broken("its EXR header has a value of " + std::to_string(value.size()) + " bytes, which is not what its type has");
        if (attribute == "dataWindow" && type == "box2i" && value.size() == 16) check_window(value);
        if (type == "chlist") check_channels(value);
        if (attribute == "tiles" && type == "tiledesc" && value.size() == 9)
            check_area(little_endian(value), little_endian(value.subspan(4)), "tiles");
        if (attribute == "chunkCount" && type == "int" && value.size() == 4 && little_endian(value) > file_size_ / bytes_per_chunk)
            throw broken("its EXR header claims " + std::to_string(little_endian(value)) + " chunks");
        return true;
    }

    // Readers take time that grows with their number's square, and texts that list them as long as the header.
    void check_channels(std::span<const std::byte> value)
    {
        constexpr std::size_t after_name = 16;
        for (std::size_t count = 0;; ++count) {
            const std::optional<std::string_view> name = take_name(value);
            if (!name || name->empty()) return; // its end, or broken in a way that readers tell
            if (count == most_channels)
                throw Error(ErrorCode::too_large, std::string(where_) + " has more than " + std::to_string(most_channels) + " channels");
            value = value.subspan(std::min(after_name, value.size()));
        }
    }

    void check_window(std::span<const std::byte> value)
    {
        const auto corner = [&](std::size_t i) { return std::int64_t{integer(value.subspan(4 * i))}; };
        const std::int64_t width = corner(2) - corner(0) + 1, height = corner(3) - corner(1) + 1;
        if (width < 1 || height < 1) throw broken("its EXR data window is empty");
        check_area(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height), "a data window");
        if (static_cast<std::uint64_t>(height) / rows_per_chunk > file_size_ / bytes_per_chunk ||
            static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) / pixels_per_byte > file_size_)
            throw broken(std::to_string(file_size_) + " bytes cannot hold " + std::to_string(width) + " x " + std::to_string(height) +
                         " pixels");
    }

    // Both sides are below 2^33: their product needs a look before it is made.
    void check_area(std::uint64_t width, std::uint64_t height, const char* what) const
    {
        if (width != 0 && height > max_samples_ / width)
            throw Error(ErrorCode::too_large, std::string(where_) + " has " + what + " of " + std::to_string(width) + " x " +
                                                  std::to_string(height) + "; the limit is " + std::to_string(max_samples_) + " samples");
    }

    std::span<const std::byte> rest_;
    std::string_view where_;
    std::uint64_t file_size_, max_samples_;
};

} // namespace

void check_exr_header(std::span<const std::byte> exr, std::string_view where, std::uint64_t max_samples)
{
    HeaderReader(exr, where, max_samples).check();
}

} // namespace penumbra
