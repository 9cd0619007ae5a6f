// What of an image its camera saw: display windows, overscan, pixel aspect, lenses; and images without any depth.
#include <cmath>

#include "io/made_images.hpp"
#include "io/scene_support.hpp"
#include "scene/camera.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

// Data from (x, y) of 4 x 3 pixels, in a display window of `full` x `high` from (0, 0) or elsewhere; values 1 to 12.
std::vector<std::byte> windowed(int x, int y, int full, int high, bool tiled, int full_x = 0, int full_y = 0, float aspect = 1)
{
    std::vector<float> values;
    for (int i = 1; i <= 12; ++i) values.push_back(static_cast<float>(i));
    return bytes_of({.width = 4, .height = 3, .parts = {{"", {{"Z", values}}, [=](OIIO::ImageSpec& spec) {
                                                             spec.x = x;
                                                             spec.y = y;
                                                             spec.full_x = full_x;
                                                             spec.full_y = full_y;
                                                             spec.full_width = full;
                                                             spec.full_height = high;
                                                             if (tiled) spec.tile_width = spec.tile_height = 16;
                                                             if (aspect != 1) spec.attribute("PixelAspectRatio", aspect);
                                                         }}}});
}

const std::string looking = R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, -1], "vertical_fov_deg": 90})";

Scene read_with(std::vector<std::byte> bytes, const std::string& members)
{
    MemoryResources resources;
    resources.parts["file"] = std::move(bytes);
    return parse_scene(scene_of(point + ", " + members), resources);
}

Scene receivers_of(std::vector<std::byte> bytes, const std::string& camera = looking, const std::string& more = "")
{
    return read_with(std::move(bytes), R"("receivers": {"depth": "file", "camera": )" + camera + more + "}");
}

SeenSurface object_of(std::vector<std::byte> bytes, const std::string& camera = looking, const std::string& more = "")
{
    return *read_with(std::move(bytes), R"("objects": [{"depth": "file", "camera": )" + camera + more + "}]").objects[0].seen;
}

// Where the data's pixel (column, row) shows, seen through the whole frame: the direction, at depth 1.
Vec3 direction(const SeenSurface& seen, double column, double row)
{
    return camera_point(seen.camera, seen.depth.width, seen.depth.height, column, row, 1);
}

} // namespace

TEST(DepthWindow, CroppedRendersKeepTheFrame)
{
    for (const bool tiled : {false, true}) {
        const Scene scene = receivers_of(windowed(2, 1, 8, 6, tiled));
        const DepthMap& map = *scene.receivers.depth;
        ASSERT_EQ(map.width, 8);
        ASSERT_EQ(map.height, 6);
        for (int y = 0; y < 6; ++y)
            for (int x = 0; x < 8; ++x) {
                const bool inside = x >= 2 && x < 6 && y >= 1 && y < 4;
                EXPECT_EQ(map.at(x, y), inside ? static_cast<float>(4 * (y - 1) + x - 1) : nothing_there) << x << ", " << y;
            }
    }
}

TEST(DepthWindow, OverscanIsLeftOutOfTheMask)
{
    for (const bool tiled : {false, true}) {
        const DepthMap map = *receivers_of(windowed(-1, -1, 2, 1, tiled)).receivers.depth;
        ASSERT_EQ(map.width, 2);
        ASSERT_EQ(map.height, 1);
        EXPECT_EQ(map.depth, (std::vector<float>{6, 7}));
        // The frame may begin anywhere.
        const DepthMap moved = *receivers_of(windowed(-11, 19, 2, 1, tiled, -10, 20)).receivers.depth;
        EXPECT_EQ(moved.depth, (std::vector<float>{6, 7}));
    }
}

// Half a height of 45 degrees: the frame's upper edge is at 1, and a frame of 8 x 6 reaches to 4/3 across.
TEST(DepthWindow, ObjectsSeeWhatLiesBeyondAtWiderAngles)
{
    const SeenSurface crop = object_of(windowed(2, 1, 8, 6, false));
    ASSERT_EQ(crop.depth.width, 4);
    EXPECT_NEAR(direction(crop, 0, 0).x, -2 / 3., 1e-12); // the frame's pixel (2, 1)
    EXPECT_NEAR(direction(crop, 0, 0).y, 2 / 3., 1e-12);
    EXPECT_NEAR(direction(crop, 4, 3).x, 2 / 3., 1e-12);
    EXPECT_NEAR(direction(crop, 4, 3).y, -1 / 3., 1e-12);

    const SeenSurface over = object_of(windowed(-1, -1, 2, 1, false));
    ASSERT_EQ(over.depth.width, 4);
    EXPECT_NEAR(direction(over, 1, 1).x, -2, 1e-12);
    EXPECT_NEAR(direction(over, 1, 1).y, 1, 1e-12);
    EXPECT_NEAR(direction(over, 0, 0).x, -4, 1e-12);
    EXPECT_NEAR(direction(over, 0, 0).y, 3, 1e-12);
}

TEST(DepthWindow, RadialDepthGoesByItsPlaceInTheFrame)
{
    const std::string radial = R"(, "encoding": {"kind": "radial"})";
    const DepthMap map = *receivers_of(windowed(2, 1, 8, 6, false), looking, radial).receivers.depth;
    const SeenSurface seen = object_of(windowed(2, 1, 8, 6, false), looking, radial);
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 4; ++x) {
            const double expected = (4 * y + x + 1) / direction(seen, x + .5, y + .5).length();
            EXPECT_NEAR(seen.depth.at(x, y), expected, 1e-6 * expected);
            EXPECT_NEAR(map.at(x + 2, y + 1), expected, 1e-6 * expected);
        }
}

TEST(DepthWindow, PixelAspectCountsWithTheVerticalAngle)
{
    for (const bool tiled : {false, true}) {
        EXPECT_EQ(std::get<PinholeCamera>(receivers_of(windowed(0, 0, 4, 3, tiled, 0, 0, 2)).receivers.camera).pixel_aspect, 2);
        const SeenSurface seen = object_of(windowed(0, 0, 4, 3, tiled, 0, 0, 2));
        EXPECT_NEAR(seen.camera.half_extent.x, 2 * 4 / 3., 1e-12);
        EXPECT_NEAR(seen.camera.half_extent.y, 1, 1e-12);
    }
    // Angles that are given for both ways stay.
    const SeenSurface given = object_of(
        windowed(0, 0, 4, 3, false, 0, 0, 2),
        R"({"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "tan_half_fov": [0.5, 0.4]})");
    EXPECT_EQ(given.camera.half_extent, Vec2(.5, .4));
}

TEST(DepthWindow, FramesHaveLimits)
{
    const auto huge = [](bool tiled) { return windowed(0, 0, 1 << 20, 1 << 15, tiled); };
    for (const bool tiled : {false, true}) EXPECT_EQ(error_of([&] { receivers_of(huge(tiled)); }).code(), ErrorCode::too_large);
}

TEST(DepthWindow, APictureMustBeWhole)
{
    EXPECT_MENTIONS(error_of([] { decode_image(windowed(2, 1, 8, 6, false), "x"); }), "display window of 8 x 6");
}

// x / z = (column - cx) / fx, y / z = (cy - row) / fy.
TEST(Lens, IntrinsicsAreTheProjection)
{
    const SeenSurface seen = object_of(
        windowed(0, 0, 4, 3, false),
        R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, -1], "intrinsics": {"fx": 5, "fy": 4, "cx": 1.5, "cy": 2.25}})");
    for (const double x : {0., .5, 3.})
        for (const double y : {0., 1.5, 3.}) {
            EXPECT_NEAR(direction(seen, x, y).x, (x - 1.5) / 5, 1e-12);
            EXPECT_NEAR(direction(seen, x, y).y, (2.25 - y) / 4, 1e-12);
            const Projected back = project(seen.camera, 4, 3, world_point(seen.camera, 4, 3, x, y, 7));
            EXPECT_NEAR(back.x_px, x, 1e-12);
            EXPECT_NEAR(back.y_px, y, 1e-12);
            EXPECT_NEAR(back.depth, 7, 1e-12);
        }
}

// A quarter of the width to the right: the axis meets the image a quarter of its width left of the middle.
TEST(Lens, ShiftMovesTheImage)
{
    const SeenSurface seen =
        object_of(windowed(0, 0, 4, 3, false),
                  R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, -1], "vertical_fov_deg": 90, "shift": [0.25, -0.5]})");
    EXPECT_NEAR(direction(seen, 1, 0).x, 0, 1e-12);
    EXPECT_NEAR(direction(seen, 1, 0).y, 0, 1e-12);
    EXPECT_NEAR(direction(seen, 4, 3).x, 2, 1e-12);
    EXPECT_NEAR(direction(seen, 4, 3).y, -2, 1e-12);
}

TEST(Lens, WrittenScenesReadBackAlike)
{
    const std::string camera =
        R"({"kind": "pinhole", "eye": [1, 2, 3], "target": [0, 0, 0], "intrinsics": {"fx": 5, "fy": 4, "cx": 1.5, "cy": 2.25}, "shift": [0.1, 0]})";
    const Scene scene = receivers_of(windowed(0, 0, 4, 3, false), camera);
    MemoryResources resources;
    resources.parts["file"] = windowed(0, 0, 4, 3, false);
    DepthNames names;
    names.receiver = "file";
    const Scene again = parse_scene(write_scene(scene, names), resources);
    const Camera one = pinhole_view(std::get<PinholeCamera>(scene.receivers.camera), 4, 3),
                 other = pinhole_view(std::get<PinholeCamera>(again.receivers.camera), 4, 3);
    EXPECT_LT((one.half_extent - other.half_extent).length() + (one.off_axis - other.off_axis).length(), 1e-12);
}

TEST(DepthValues, AnImageWithoutDepthIsDescribed)
{
    const auto warning = [](const std::vector<float>& values, const std::string& more) {
        const Scene scene = receivers_of(bytes_of(MadeImage{.width = 2, .height = 2, .parts = {{"", {{"Z", values}}}}}), looking, more);
        EXPECT_EQ(scene.warnings.size(), 1u);
        return scene.warnings.empty() ? std::string() : scene.warnings[0];
    };
    EXPECT_EQ(warning({0, INFINITY, 1e10f, 0}, ""),
              "receivers.depth: file shows no surface: 4 values from 0 to 1e+10, 0 negative, 2 zero, 1 infinite or no number");
    EXPECT_EQ(warning({1, 1, 1, 1}, R"(, "encoding": {"kind": "window", "near": 1, "far": 2})"),
              "receivers.depth: file shows no surface: 4 values from 1 to 1, 0 negative, 0 zero, 0 infinite or no number");
    EXPECT_MENTIONS(error_of([] {
                        receivers_of(bytes_of(MadeImage{.width = 2, .height = 2, .parts = {{"", {{"Z", {-1, -2, -3, 0}}}}}}));
                    }),
                    "negative");
}

TEST(DepthValues, PfmHeadersMayEndInCarriageReturns)
{
    // 10 is the first byte of the first sample: what looks like the end of a line is none where the size leaves no room for it.
    const std::vector<float> values{std::bit_cast<float>(0x4000000au), 3, 4, 5};
    const std::string samples(reinterpret_cast<const char*>(values.data()), 16);
    for (const char* header : {"Pf\n2 2\n-1.0\n", "Pf\r\n2 2\r\n-1.0\r\n", "Pf\r2 2\r-1.0\r"}) {
        const RawDepth raw = decode_raw_depth(bytes_of(header + samples), "", "x");
        EXPECT_EQ(raw.samples, (std::vector<float>{4, 5, values[0], 3}));
    }
}
