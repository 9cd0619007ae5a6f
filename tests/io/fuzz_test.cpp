// Mutated input either works or throws penumbra::Error; it never crashes and never throws anything else. Seeds are fixed.
#include <random>

#include "io/ply.hpp"
#include "io/support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

std::string text_of(std::span<const std::byte> bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

// One to four edits: a byte set, a bit turned, a piece taken out, doubled, or replaced by a word that parsers dislike.
std::string mutated(std::string text, std::mt19937& random, const std::vector<std::string>& words)
{
    const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
    for (std::size_t edits = 1 + below(4); edits-- > 0 && !text.empty();) {
        const std::size_t at = below(text.size());
        switch (below(5)) {
        case 0:
            text[at] = static_cast<char>(random());
            break;
        case 1:
            text[at] = static_cast<char>(text[at] ^ (1 << below(8)));
            break;
        case 2:
            text.erase(at, 1 + below(20));
            break;
        case 3:
            text.insert(at, text.substr(at, 1 + below(30)));
            break;
        default:
            text.replace(at, std::min<std::size_t>(text.size() - at, 1 + below(6)), words[below(words.size())]);
            break;
        }
    }
    return text;
}

template <class Act> void expect_error_or_success(int round, const Act& act)
{
    try {
        act();
    } catch (const Error& error) {
        const std::string text = error.what();
        EXPECT_FALSE(text.empty());
        EXPECT_EQ(text.find('\n'), std::string::npos) << "round " << round << ": " << text;
        EXPECT_NE(error.code(), ErrorCode::internal) << "round " << round << ": " << text;
    } catch (const std::exception& other) {
        ADD_FAILURE() << "round " << round << " threw " << other.what();
    }
}

} // namespace

TEST(Fuzz, Scenes)
{
    MemoryResources resources;
    resources.limit = 1 << 16;
    resources.parts["d.exr"] = encode_image(constant(2, 2, 2), {"exr", 32});
    const std::string scene =
        R"({"penumbra": 1, "light": {"kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5]},
        "objects": [{"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}, "scale": 1.5, "rotate_deg": [0, 30, 0], "casts": false},
            {"depth": "d.exr", "camera": {"kind": "pinhole", "eye": [0, 1, 5], "target": [0, 0, 0], "vertical_fov_deg": 60}}],
        "occluders": {"camera": {"kind": "light", "tan_half_fov": [0.5, 0.5]}, "depth": {"front": "d.exr", "layers": ["d.exr"]}, "encoding": {"kind": "radial"}},
        "receivers": {"resolution": [2, 2], "depth": "d.exr", "encoding": {"kind": "normalized", "near": 1, "far": 9},
            "camera": {"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "tan_half_fov": [1, 1]}},
        "technique": {"kind": "soft_shadow_map", "sides": "both"}, "output": {"format": "exr", "bits": 32}})";
    const std::vector<std::string> words{"null",
                                         "-1",
                                         "1e308",
                                         "-1e-308",
                                         "0",
                                         "[]",
                                         "{}",
                                         "\"\"",
                                         "true",
                                         "1e999",
                                         "\"d.exr\"",
                                         "[[[[",
                                         "18446744073709551616",
                                         "\\u0000",
                                         "\xff",
                                         "\"radial\"",
                                         "\"kind\": ",
                                         ",",
                                         "nan"};
    std::mt19937 random(20061);
    for (int round = 0; round < 8000; ++round)
        expect_error_or_success(round, [&] { parse_scene(mutated(scene, random, words), resources); });
}

TEST(Fuzz, Images)
{
    const std::vector<std::string> words{
        std::string(4, '\0'), std::string(4, '\xff'), std::string("\x7f\xff\xff\xff", 4), "\xff\xff\xff\x7f", "-1", "999999999", "nan"};
    std::mt19937 random(20062);
    for (const OutputFormat& format : {OutputFormat{"exr", 32}, OutputFormat{"exr", 16}, OutputFormat{"tif", 32}, OutputFormat{"tif", 8},
                                       OutputFormat{"png", 16}, OutputFormat{"png", 8}, OutputFormat{"pfm", 32}, OutputFormat{"hdr", 32}}) {
        SCOPED_TRACE(format.format + std::to_string(format.bits));
        const std::string whole = text_of(encode_image(ramp(9, 7, 3), format));
        for (int round = 0; round < 1500; ++round) {
            const std::vector<std::byte> bytes = bytes_of(mutated(whole, random, words));
            expect_error_or_success(round, [&] { decode_image(bytes, "x", 1 << 14); });
            expect_error_or_success(round, [&] { decode_raw_depth(bytes, "", "x", 1 << 14); });
        }
    }
}

TEST(Fuzz, PolygonFiles)
{
    const std::vector<std::string> words{"-1", "4294967296", "nan", "list", "element", "end_header\n", "\n", "uchar"};
    std::mt19937 random(20063);
    for (const char* name : {"cube.ply", "cube_binary.ply"}) {
        const std::string whole = text_of(read_file(std::string(PENUMBRA_TEST_MODELS) + "/PLY/" + name, name));
        for (int round = 0; round < 2000; ++round)
            expect_error_or_success(round, [&] { decode_ply(bytes_of(mutated(whole, random, words)), "x"); });
    }
}
