// Files with the conventions of the programs and sensors in docs/depth.md: each row of its table gives the depth that was written.
#include <cmath>
#include <fstream>
#include <sstream>

#include <nlohmann/json.hpp>

#include "io/made_images.hpp"
#include "io/scene_support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

constexpr int width = 8, height = 6;
constexpr std::size_t hole = 9; // the pixel with nothing in it

using Samples = std::vector<float>;

// What the camera sees, in scene units; some slope, so that no two pixels are alike.
double truth(std::size_t i) { return 2 + 0.3 * static_cast<double>(i % width) + 0.17 * static_cast<double>(i / width); }

// Samples from depth; `empty` in the hole.
Samples stored(const std::function<double(double depth, std::size_t i)>& store, double empty)
{
    Samples samples;
    for (std::size_t i = 0; i < width * height; ++i) samples.push_back(static_cast<float>(i == hole ? empty : store(truth(i), i)));
    return samples;
}

Samples plain(double empty)
{
    return stored([](double z, std::size_t) { return z; }, empty);
}

Samples same(float value) { return Samples(width * height, value); }

// Bottom up, as PFM and a graphics library's own memory hold rows: OpenImageIO does not write PFM.
std::vector<std::byte> pfm_of(const Samples& samples)
{
    Image image{width, height, 1, samples};
    return encode_image(image, {"pfm", 32});
}

const std::string camera_line = R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, -1], "vertical_fov_deg": 40})";

// The tangents of a pixel's centre in that camera.
Vec2 tangents(std::size_t i)
{
    const double half = std::tan(20 * M_PI / 180), x = static_cast<double>(i % width) + .5, y = static_cast<double>(i / width) + .5;
    return {(2 * x / width - 1) * half * width / height, (1 - 2 * y / height) * half};
}

Scene read_with(std::vector<std::byte> bytes, const std::string& members, const std::string& camera = camera_line)
{
    MemoryResources resources;
    resources.parts["file"] = std::move(bytes);
    return parse_scene(scene_of(point + R"(, "receivers": {"camera": )" + camera + ", " + members + "}"), resources);
}

// The row's scene lines stand in the document, and the file gives the truth with them, up to `tolerance` of the depth.
void expect_truth(std::vector<std::byte> bytes, const std::string& line, double tolerance, const std::string& key = "depth",
                  const std::string& camera = camera_line)
{
    SCOPED_TRACE(line);
    if (line != "nothing") {
        std::ifstream file(std::string(PENUMBRA_EXAMPLES) + "/../docs/depth.md", std::ios::binary);
        std::stringstream text;
        text << file.rdbuf();
        EXPECT_NE(text.str().find("`" + line + "`"), std::string::npos) << "docs/depth.md has no such line";
    }
    const Scene scene =
        read_with(std::move(bytes), "\"" + key + "\": \"file\"" + (line.starts_with("\"encoding\"") ? ", " + line : ""), camera);
    ASSERT_TRUE(scene.receivers.depth);
    const DepthMap& map = *scene.receivers.depth;
    ASSERT_EQ(map.width, width);
    ASSERT_EQ(map.height, height);
    for (std::size_t i = 0; i < map.depth.size(); ++i) {
        if (i == hole)
            EXPECT_EQ(map.depth[i], nothing_there);
        else
            EXPECT_NEAR(map.depth[i], truth(i), tolerance * truth(i)) << "pixel " << i;
    }
}

MadeImage exr(std::vector<std::pair<std::string, Samples>> channels, OIIO::TypeDesc type = OIIO::TypeFloat)
{
    return {.width = width, .height = height, .parts = {{"", std::move(channels)}}, .type = type};
}

} // namespace

// Beside depth an ordinary file has everything else that ends in Z.
TEST(DepthPrograms, Blender)
{
    const Samples other = same(.5f);
    expect_truth(bytes_of(exr({{"ViewLayer.Combined.R", other},
                               {"ViewLayer.Combined.G", other},
                               {"ViewLayer.Combined.B", other},
                               {"ViewLayer.Combined.A", other},
                               {"ViewLayer.Depth.Z", plain(1e10)},
                               {"ViewLayer.Mist.Z", other},
                               {"ViewLayer.Normal.X", other},
                               {"ViewLayer.Normal.Y", other},
                               {"ViewLayer.Normal.Z", other},
                               {"ViewLayer.Vector.X", other},
                               {"ViewLayer.Vector.Y", other},
                               {"ViewLayer.Vector.Z", other},
                               {"ViewLayer.Vector.W", other}})),
                 "nothing", 1e-6);
    // Older versions, and a file of its own from the compositor.
    expect_truth(bytes_of(exr({{"RenderLayer.Depth.V", plain(1e10)}, {"RenderLayer.Normal.Z", other}})), "nothing", 1e-6);
    expect_truth(bytes_of(exr({{"V", plain(1e10)}})), "nothing", 1e-6);
}

// A camera shift of .1: the image lies to the right of the axis by a tenth of its width.
TEST(DepthPrograms, BlenderShift)
{
    const Scene scene =
        read_with(bytes_of(exr({{"ViewLayer.Depth.Z", plain(1e10)}})), "\"depth\": \"file\"",
                  R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, -1], "vertical_fov_deg": 40, "shift": [0.1, 0]})");
    EXPECT_EQ(std::get<PinholeCamera>(scene.receivers.camera).shift, Vec2(.1, 0));
}

TEST(DepthPrograms, PositionPasses)
{
    // The camera stands at the origin and looks along -Z.
    const auto axis = [](int c) {
        return stored([c](double z, std::size_t i) { return c == 0 ? tangents(i).x * z : c == 1 ? tangents(i).y * z : -z; }, 0);
    };
    const Samples other = same(.5f);
    const std::vector<std::byte> blender = bytes_of(exr({{"ViewLayer.Combined.R", other},
                                                         {"ViewLayer.Position.X", axis(0)},
                                                         {"ViewLayer.Position.Y", axis(1)},
                                                         {"ViewLayer.Position.Z", axis(2)},
                                                         {"ViewLayer.Normal.X", other},
                                                         {"ViewLayer.Normal.Y", other},
                                                         {"ViewLayer.Normal.Z", other}}));
    expect_truth(blender, "\"position\": \"P.exr\"", 1e-6, "position");
    const std::vector<std::byte> arnold =
        bytes_of(exr({{"P.R", axis(0)}, {"P.G", axis(1)}, {"P.B", axis(2)}, {"R", other}, {"G", other}, {"B", other}}));
    expect_truth(arnold, "\"position\": \"P.exr\"", 1e-6, "position");
    EXPECT_TRUE(read_with(arnold, "\"position\": \"file\"").warnings.empty());
    // A camera elsewhere does not see them where they are.
    const Scene wrong = read_with(arnold, "\"position\": \"file\"",
                                  R"({"kind": "pinhole", "eye": [3, 0, 0], "target": [3, 0, -1], "vertical_fov_deg": 40})");
    ASSERT_EQ(wrong.warnings.size(), 1u);
    EXPECT_NE(wrong.warnings[0].find("beside their own pixel"), std::string::npos) << wrong.warnings[0];
    const Scene behind = read_with(arnold, "\"position\": \"file\"",
                                   R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, 1], "vertical_fov_deg": 40})");
    ASSERT_EQ(behind.warnings.size(), 2u);
    EXPECT_NE(behind.warnings[0].find("47 of 47 positions lie behind the camera"), std::string::npos) << behind.warnings[0];
}

// Autocrop: the data window holds what is there, here without the first row and column, where the truth is nothing then.
TEST(DepthPrograms, Arnold)
{
    const Samples other = same(.5f);
    expect_truth(
        bytes_of(
            exr({{"R", other}, {"G", other}, {"B", other}, {"A", other}, {"Z", plain(0)}, {"N.X", other}, {"N.Y", other}, {"N.Z", other}})),
        "nothing", 1e-6);
    MadeImage cropped{.width = width - 1, .height = height - 1, .parts = {{"", {{"Z", {}}}, [](OIIO::ImageSpec& spec) {
                                                                               spec.x = spec.y = 1;
                                                                               spec.full_x = spec.full_y = 0;
                                                                               spec.full_width = width;
                                                                               spec.full_height = height;
                                                                           }}}};
    for (std::size_t i = 0; i < width * height; ++i)
        if (i % width > 0 && i / width > 0) cropped.parts[0].channels[0].second.push_back(static_cast<float>(truth(i)));
    const DepthMap map = *read_with(bytes_of(cropped), "\"depth\": \"file\"").receivers.depth;
    ASSERT_EQ(map.depth.size(), static_cast<std::size_t>(width * height));
    for (std::size_t i = 0; i < map.depth.size(); ++i)
        EXPECT_EQ(map.depth[i], i % width > 0 && i / width > 0 ? static_cast<float>(truth(i)) : nothing_there) << i;
}

TEST(DepthPrograms, VRay)
{
    // Near is white: 1 at 1, 0 at 6 and beyond.
    const Samples inverted = stored([](double z, std::size_t) { return (6 - z) / 5; }, 0);
    const std::string line = R"("encoding": { "kind": "normalized", "near": 6, "far": 1 })";
    const Samples other = same(.25f);
    expect_truth(bytes_of(exr({{"R", other},
                               {"G", other},
                               {"B", other},
                               {"VRayZDepth.R", inverted},
                               {"VRayZDepth.G", inverted},
                               {"VRayZDepth.B", inverted}})),
                 line, 1e-5);
    // Parts that all call their channels R, G, B.
    const MadeImage parts{.width = width,
                          .height = height,
                          .parts = {{"RGB_color", {{"R", other}, {"G", other}, {"B", other}}},
                                    {"normals", {{"R", other}, {"G", other}, {"B", other}}},
                                    {"ZDepth", {{"R", inverted}, {"G", inverted}, {"B", inverted}}}}};
    expect_truth(bytes_of(parts), line, 1e-5);
    expect_truth(bytes_of(parts), R"("encoding": { "kind": "normalized", "near": 6, "far": 1, "part": "ZDepth", "channel": "R" })", 1e-5);
    // 16-bit PNG.
    MadeImage png = exr({{"Y", stored([](double z, std::size_t) { return std::round((6 - z) / 5 * 65535); }, 0)}}, OIIO::TypeUInt16);
    png.plugin = "png";
    expect_truth(bytes_of(png), line, 2e-4);
    // Black at 1, white at 6.
    expect_truth(bytes_of(exr({{"ZDepth.R", stored([](double z, std::size_t) { return (z - 1) / 5; }, 1)}})),
                 R"("encoding": { "kind": "normalized", "near": 1, "far": 6, "empty": 1 })", 1e-5);
}

TEST(DepthPrograms, Karma)
{
    const Samples other = same(.5f), z = plain(0), negative = stored([](double depth, std::size_t) { return -depth; }, 0);
    expect_truth(bytes_of(exr({{"C.R", other}, {"C.G", other}, {"C.B", other}, {"depth", z}, {"N.z", other}, {"P.z", other}})), "nothing",
                 1e-6);
    expect_truth(bytes_of(exr({{"R", other}, {"G", other}, {"B", other}, {"hitPz", z}})), R"("encoding": { "channel": "hitPz" })", 1e-6);
    expect_truth(bytes_of(exr({{"R", other}, {"G", other}, {"B", other}, {"hitPz", negative}})),
                 R"("encoding": { "channel": "hitPz", "scale": -1 })", 1e-6);
}

// Centimetres in half floats, which end at 65504 in the sky.
TEST(DepthPrograms, Unreal)
{
    const Samples depth = stored([](double z, std::size_t) { return z * 100; }, 65504), other = same(.5f);
    const std::string layer = "FinalImageMovieRenderQueue_WorldDepth";
    expect_truth(bytes_of(exr({{"R", other},
                               {"G", other},
                               {"B", other},
                               {"A", other},
                               {layer + ".R", depth},
                               {layer + ".G", other},
                               {layer + ".B", other},
                               {layer + ".A", other}},
                              OIIO::TypeHalf)),
                 R"("encoding": { "scale": 0.01 })", 0x1p-11);
}

TEST(DepthPrograms, Unity)
{
    const double n = .3, f = 1000;
    expect_truth(bytes_of(exr({{"R", stored([&](double z, std::size_t) { return (1 / z - 1 / f) / (1 / n - 1 / f); }, 0)}})),
                 R"("encoding": { "kind": "reversed_window", "near": 0.3, "far": 1000 })", 1e-5);
    expect_truth(bytes_of(exr({{"R", stored([&](double z, std::size_t) { return (1 / n - 1 / z) / (1 / n - 1 / f); }, 1)}})),
                 R"("encoding": { "kind": "window", "near": 0.3, "far": 1000 })", 1e-5);
    // Linear01Depth.
    expect_truth(bytes_of(exr({{"R", stored([&](double z, std::size_t) { return z / f; }, 1)}})),
                 R"("encoding": { "kind": "normalized", "near": 0, "far": 1000, "empty": 1 })", 1e-5);
}

TEST(DepthPrograms, Three)
{
    const double n = 1, f = 10;
    const auto w = [&](double z) { return (1 / n - 1 / z) / (1 / n - 1 / f); };
    expect_truth(pfm_of(stored([&](double z, std::size_t) { return w(z); }, 1)),
                 R"("encoding": { "kind": "window", "near": 1, "far": 10 })", 1e-5);
    // MeshDepthMaterial: 1 - w as a grey picture of 8 bits.
    const Samples grey = stored([&](double z, std::size_t) { return std::round((1 - w(z)) * 255); }, 0);
    MadeImage png = exr({{"R", grey}, {"G", grey}, {"B", grey}, {"A", same(255)}}, OIIO::TypeUInt8);
    png.plugin = "png";
    expect_truth(bytes_of(png), R"("encoding": { "kind": "reversed_window", "near": 1, "far": 10, "channel": "R" })", 1e-2);
}

// Millimetres of 16 bits with 0 for holes, and the lens of the calibration.
TEST(DepthPrograms, RealSense)
{
    MadeImage png = exr({{"Y", stored([](double z, std::size_t) { return std::round(z * 1000); }, 0)}}, OIIO::TypeUInt16);
    png.plugin = "png";
    const std::string camera =
        R"({"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "intrinsics": {"fx": 8, "fy": 8.5, "cx": 4.5, "cy": 2.5}})";
    expect_truth(bytes_of(png), R"("encoding": { "scale": 0.001 })", 3e-4, "depth", camera);
    const Scene scene = read_with(bytes_of(png), R"("depth": "file", "encoding": {"scale": 0.001})", camera);
    const std::optional<Intrinsics>& lens = std::get<PinholeCamera>(scene.receivers.camera).intrinsics;
    ASSERT_TRUE(lens);
    EXPECT_EQ(lens->cx, 4.5);
}

// Disparity up to scale and shift, in floats or stretched over 16 bits.
TEST(DepthPrograms, Networks)
{
    const auto network = [](double scale, double shift) { return [=](double z, std::size_t) { return (1 / z - shift) / scale; }; };
    const std::string line =
        R"("encoding": { "kind": "disparity", "anchors": [{ "pixel": [0, 0], "depth": 2 }, { "pixel": [7, 0], "depth": 4.1 }, { "pixel": [0, 5], "depth": 2.85 }] })";
    expect_truth(pfm_of(stored(network(.0013, .02), -1)), line, 1e-5);
    MadeImage png =
        exr({{"Y", stored([&](double z, std::size_t i) { return std::round(network(1e-5, .02)(z, i)); }, 0)}}, OIIO::TypeUInt16);
    png.plugin = "png";
    expect_truth(bytes_of(png), line, 1e-3);
    expect_truth(pfm_of(stored(network(.0013, .02), -1)), R"("encoding": { "kind": "disparity", "scale": 0.0013, "shift": 0.02 })", 1e-5);
    // Metric networks give depth.
    expect_truth(pfm_of(plain(0)), "nothing", 1e-6);
}

// Focal length 700 pixels, baseline .12.
TEST(DepthPrograms, Stereo)
{
    const double b = 700 * .12;
    MadeImage png = exr({{"Y", stored([&](double z, std::size_t) { return std::round(b / z * 256); }, 0)}}, OIIO::TypeUInt16);
    png.plugin = "png";
    expect_truth(bytes_of(png), R"("encoding": { "kind": "disparity", "scale": 21504 })", 1e-3); // 256 b: 1/256 pixels, as KITTI has it
    png.parts[0].channels[0].second = stored([&](double z, std::size_t) { return std::round(b / z * 16); }, 0);
    expect_truth(bytes_of(png), R"("encoding": { "kind": "disparity", "scale": 1344 })", 3e-3); // 16 b: 1/16 pixels, as OpenCV has it
    // Middlebury: floats with infinity for holes, less an offset of 30 pixels between the principal points.
    expect_truth(pfm_of(stored([&](double z, std::size_t) { return b / z - 15; }, INFINITY)),
                 R"("encoding": { "kind": "disparity", "scale": 0.011904762, "shift": 0.17857143 })", 1e-5);
}

// Planar floats with 0 for holes; axes as in computer vision: y down, z along the view.
TEST(DepthPrograms, Photogrammetry)
{
    MadeImage tiff = exr({{"Y", plain(0)}});
    tiff.plugin = "tiff";
    const std::string camera =
        R"({"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1], "intrinsics": {"fx": 8, "fy": 8, "cx": 4, "cy": 3}})";
    expect_truth(bytes_of(tiff), "nothing", 1e-6, "depth", camera);
    tiff.parts[0].channels[0].second = plain(-32767);
    expect_truth(bytes_of(tiff), R"("encoding": { "empty": -32767 })", 1e-6, "depth", camera);
}
