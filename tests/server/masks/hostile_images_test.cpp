// Images that are truncated or say what is not so, through the service: 4xx with the key that named the part, and no memory for their
// claims.
#include <cstring>

#include "http/metrics.hpp"
#include "server/client.hpp"

namespace penumbra::test {
namespace {

std::string encoded(const std::string& format, int bits)
{
    // Between 0 and 1, which integers hold as well: an occluder at 1, and nothing (0) around it.
    return text_of(encode_image(image_of(occluder_depth(), 0, 1), {format, bits}));
}

Reply send_as_occluder(const std::string& bytes)
{
    nlohmann::json scene = scene_json();
    scene["occluders"]["encoding"] = {{"kind", "normalized"}, {"near", 0}, {"far", 1}, {"empty", 0}};
    Parts all = parts(scene);
    all[1].second = bytes;
    return ask(shared_port(), post(form(all), "Accept: image/x-portable-floatmap\r\n"));
}

void expect_named(const Reply& reply, const std::string& what)
{
    EXPECT_TRUE(reply.status == 422 || reply.status == 413) << what << ": " << reply.status << reply.head;
    ASSERT_EQ(reply.header("Content-Type"), "application/problem+json") << what;
    EXPECT_TRUE(holds(reply.detail(), "occluders.depth.front")) << what << ": " << reply.body.substr(0, 300);
}

// The resident bytes that `act` leaves behind.
template <class Act> double growth(const Act& act)
{
    const double before = server::resident_bytes();
    act();
    return server::resident_bytes() - before;
}

struct Format {
    const char* name;
    int bits;
};
constexpr std::array formats{Format{"exr", 32}, Format{"exr", 16}, Format{"png", 16}, Format{"tif", 32}, Format{"pfm", 32}};

TEST(HostileImages, Truncated)
{
    for (const Format& format : formats) {
        const std::string whole = encoded(format.name, format.bits);
        const Reply expected = send_as_occluder(whole);
        for (std::size_t tenth = 0; tenth < 10; ++tenth) {
            const std::string what = format.name + std::string(" cut at ") + std::to_string(tenth) + "/10";
            expect_named(send_as_occluder(whole.substr(0, whole.size() * tenth / 10)), what);
        }
        // What ends a file may be missing where all pixels are there; then the mask is the whole image's.
        const Reply last = send_as_occluder(whole.substr(0, whole.size() - 1));
        if (last.status != 200 || last.body != expected.body) expect_named(last, format.name + std::string(" without its last byte"));
    }
}

std::string big_endian(std::uint32_t value)
{
    std::string text;
    for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(value >> shift);
    return text;
}
std::string little_endian(std::uint32_t value)
{
    const std::string big = big_endian(value);
    return {big.rbegin(), big.rend()};
}

// CRC-32 of ISO 3309, as in PNG.
std::uint32_t crc(const std::string& text)
{
    std::uint32_t value = ~0u;
    for (const char c : text) {
        value ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) value = value & 1 ? value >> 1 ^ 0xedb88320u : value >> 1;
    }
    return ~value;
}

std::string png_of_size(std::uint32_t width, std::uint32_t height)
{
    std::string file = encoded("png", 16);
    const std::size_t header = file.find("IHDR");
    file.replace(header + 4, 8, big_endian(width) + big_endian(height));
    file.replace(header + 17, 4, big_endian(crc(file.substr(header, 17))));
    return file;
}

// Both windows of an EXR, from the origin.
std::string exr_of_size(std::uint32_t width, std::uint32_t height)
{
    std::string file = encoded("exr", 32);
    for (const std::string name : {"dataWindow", "displayWindow"}) {
        const std::size_t at = file.find(name + '\0' + "box2i");
        EXPECT_NE(at, std::string::npos);
        file.replace(at + name.size() + 1 + 6 + 4 + 8, 8, little_endian(width - 1) + little_endian(height - 1));
    }
    return file;
}

// Replaces the value of a tag in the first directory of a little-endian TIFF.
std::string tiff_with(std::uint16_t tag, std::uint32_t value)
{
    std::string file = encoded("tif", 32);
    std::uint32_t directory = 0;
    std::memcpy(&directory, file.data() + 4, 4);
    std::uint16_t entries = 0;
    std::memcpy(&entries, file.data() + directory, 2);
    for (std::size_t i = 0; i < entries; ++i) {
        const std::size_t at = directory + 2 + 12 * i;
        std::uint16_t found = 0;
        std::memcpy(&found, file.data() + at, 2);
        if (found != tag) continue;
        file.replace(at + 2, 10, std::string("\4\0", 2) + little_endian(1) + little_endian(value));
        return file;
    }
    ADD_FAILURE() << "no tag " << tag;
    return file;
}

// The version field's bits 9 to 12: tiles, long names, deep, multi-part.
std::string exr_with_flag(int bit)
{
    std::string file = encoded("exr", 32);
    file[5] = static_cast<char>(file[5] | 1 << (bit - 8));
    return file;
}

TEST(HostileImages, SizesThatLie)
{
    const std::vector<std::pair<std::string, std::string>> cases{
        {"EXR of no size", exr_of_size(0, 0)},
        {"EXR taller than it is", exr_of_size(side, 4 * side)},
        {"EXR 4000 x 4000", exr_of_size(4000, 4000)},
        {"EXR 100000 x 100000", exr_of_size(100000, 100000)},
        {"EXR of 2^31 - 1", exr_of_size(0x7fffffff, 0x7fffffff)},
        {"EXR of a negative size", exr_of_size(0x80000000, 0x80000000)},
        {"PNG of no size", png_of_size(0, side)},
        {"PNG taller than it is", png_of_size(side, 4 * side)},
        {"PNG 4000 x 4000", png_of_size(4000, 4000)},
        {"PNG of 2^31 - 1", png_of_size(0x7fffffff, 0x7fffffff)},
        {"TIFF of no width", tiff_with(256, 0)},
        {"TIFF 4000 wide", tiff_with(256, 4000)},
        {"TIFF 2^32 - 1 wide", tiff_with(256, 0xffffffff)},
        {"TIFF 2^31 tall", tiff_with(257, 0x80000000)},
        {"TIFF of 65535 samples a pixel", tiff_with(277, 65535)},
        {"TIFF with one strip for all rows, elsewhere", tiff_with(273, 0xfffffff0)},
        {"TIFF with a strip of 4 GiB", tiff_with(279, 0xffffffff)},
        {"PFM of no size", "Pf\n0 0\n-1\n"},
        {"PFM of a negative size", "Pf\n-32 -32\n-1\n" + std::string(4096, 'x')},
        {"PFM 4000 x 4000", "Pf\n4000 4000\n-1\n" + std::string(4096, 'x')},
        {"PFM of 2^40", "Pf\n1099511627776 1\n-1\nxxxx"},
        {"PFM of a size that overflows", "Pf\n4294967296 4294967297\n-1\nxxxx"},
        {"PFM without an end of its header", "Pf\n" + std::string(100000, '1')},
    };
    (void)send_as_occluder(encoded("exr", 32)); // what is loaded once
    for (const auto& [what, bytes] : cases) {
        // 4000 x 4000 samples are 64 MB, within the limits: none of it may stay, and nothing else may come near.
        const double grown = growth([&] { expect_named(send_as_occluder(bytes), what); });
        if (resident_memory_is_ours) {
            EXPECT_LT(grown, 4000.0 * 4000 * 4) << what;
        }
    }
}

TEST(HostileImages, KindsOfExrThatItIsNot)
{
    for (const int bit : {9, 11, 12}) {
        // Where the flag is overlooked, the file is read as what it is: pixels in lines.
        const Reply reply = send_as_occluder(exr_with_flag(bit));
        if (reply.status != 200 || reply.body != send_as_occluder(encoded("exr", 32)).body)
            expect_named(reply, "EXR with bit " + std::to_string(bit));
    }
    std::string all = encoded("exr", 32);
    all[5] = static_cast<char>(0xff);
    expect_named(send_as_occluder(all), "EXR with every bit");
}

} // namespace
} // namespace penumbra::test
