// Structs that kernels and host share are laid out alike on both.
#include <cstddef>

#include "support/device_run.hpp"
#include "support/maps.hpp"

#include "common/shared.h"
#include "opencl/kernel_files.hpp"
#include "opencl/program_cache.hpp"

namespace penumbra::test {
namespace {

// The values that a kernel with this body writes to `out`.
std::vector<cl_int> on_device(const std::string& body, std::size_t count)
{
    const std::string text = std::string(opencl::kernel_file("common/shared.h")) + R"(
#define OFFSET(type, member) ((int)((__private char*)&value.member - (__private char*)&value))
__kernel void layout(__global int* out) {
)" + body + "}\n";
    const auto context = device_context();
    opencl::ProgramCache programs(context->context(), context->device(), "");
    double compile_ms = 0;
    opencl::Work work(context);
    const auto out = work.buffer<cl_int>(count, "layout");
    work.launch(cl::Kernel(programs.program("layout", text, compile_ms), "layout"), "layout", {1, 1}, {1, 1}, 0, out);
    return work.read(out);
}

std::string writes(const std::string& type, const std::vector<std::string>& members)
{
    std::string body = "    " + type + " value;\n    out[0] = (int)sizeof(" + type + ");\n";
    for (std::size_t i = 0; i < members.size(); ++i)
        body += "    out[" + std::to_string(i + 1) + "] = OFFSET(" + type + ", " + members[i] + ");\n";
    return body;
}

#define HERE(type, member) static_cast<cl_int>(offsetof(type, member))

TEST(SharedStructs, ReceiverView)
{
    const std::vector<std::string> members = {
        "light_from_camera",  "pixel_x", "pixel_y", "off_x", "off_y", "per_light_x", "per_light_y", "camera_orthographic",
        "light_orthographic", "light_reach", "depth_error", "width", "height", "stride", "rows"};
    const std::vector<cl_int> host = {sizeof(ReceiverView),
                                      HERE(ReceiverView, light_from_camera),
                                      HERE(ReceiverView, pixel_x),
                                      HERE(ReceiverView, pixel_y),
                                      HERE(ReceiverView, off_x),
                                      HERE(ReceiverView, off_y),
                                      HERE(ReceiverView, per_light_x),
                                      HERE(ReceiverView, per_light_y),
                                      HERE(ReceiverView, camera_orthographic),
                                      HERE(ReceiverView, light_orthographic),
                                      HERE(ReceiverView, light_reach),
                                      HERE(ReceiverView, depth_error),
                                      HERE(ReceiverView, width),
                                      HERE(ReceiverView, height),
                                      HERE(ReceiverView, stride),
                                      HERE(ReceiverView, rows)};
    EXPECT_EQ(on_device(writes("ReceiverView", members), host.size()), host);
    // Every member is listed: 12 + 8 floats and 6 ints.
    EXPECT_EQ(sizeof(ReceiverView), 26 * 4u);
}

TEST(SharedStructs, OccluderView)
{
    const std::vector<std::string> members = {"width",         "height",        "texel_x",   "texel_y",
                                              "light_scale_x", "light_scale_y", "edge_on_x", "edge_on_y"};
    const std::vector<cl_int> host = {
        sizeof(OccluderView),         HERE(OccluderView, width),         HERE(OccluderView, height),        HERE(OccluderView, texel_x),
        HERE(OccluderView, texel_y),  HERE(OccluderView, light_scale_x), HERE(OccluderView, light_scale_y), HERE(OccluderView, edge_on_x),
        HERE(OccluderView, edge_on_y)};
    EXPECT_EQ(on_device(writes("OccluderView", members), host.size()), host);
    EXPECT_EQ(sizeof(OccluderView), 8 * 4u);
}

TEST(SharedStructs, Sheet)
{
    const std::vector<cl_int> host = {
        sizeof(Sheet),    HERE(Sheet, edges_begin), HERE(Sheet, edges_end), HERE(Sheet, triangles_begin), HERE(Sheet, triangles_end),
        HERE(Sheet, side)};
    EXPECT_EQ(on_device(writes("Sheet", {"edges_begin", "edges_end", "triangles_begin", "triangles_end", "side"}), host.size()), host);
    EXPECT_EQ(sizeof(Sheet), 5 * 4u);
}

TEST(SharedStructs, WedgeLight)
{
    const std::vector<std::string> members = {"scale_x", "scale_y", "scale_d", "centre_x",  "centre_y",       "reach_x",
                                              "reach_y", "bias_x",  "bias_y",  "precision", "depth_error", "position_error", "share",
                                              "sheets",  "overlap", "culling", "first"};
    const std::vector<cl_int> host = {sizeof(WedgeLight),        HERE(WedgeLight, scale_x),   HERE(WedgeLight, scale_y),
                                      HERE(WedgeLight, scale_d), HERE(WedgeLight, centre_x),  HERE(WedgeLight, centre_y),
                                      HERE(WedgeLight, reach_x), HERE(WedgeLight, reach_y),   HERE(WedgeLight, bias_x),
                                      HERE(WedgeLight, bias_y),  HERE(WedgeLight, precision), HERE(WedgeLight, depth_error), HERE(WedgeLight, position_error),
                                      HERE(WedgeLight, share),   HERE(WedgeLight, sheets),    HERE(WedgeLight, overlap),
                                      HERE(WedgeLight, culling), HERE(WedgeLight, first)};
    EXPECT_EQ(on_device(writes("WedgeLight", members), host.size()), host);
    // Every member is listed: 12 floats, a share for each channel, 4 ints.
    EXPECT_EQ(sizeof(WedgeLight), 12 * 4u + sizeof(WedgeLight::share) + 4 * 4u);
}

TEST(SharedStructs, SliceView)
{
    const std::vector<cl_int> host = {sizeof(SliceView),         HERE(SliceView, width),        HERE(SliceView, height),
                                      HERE(SliceView, slices),   HERE(SliceView, orthographic), HERE(SliceView, behind),
                                      HERE(SliceView, centre_x), HERE(SliceView, centre_y),     HERE(SliceView, low_x),
                                      HERE(SliceView, low_y),    HERE(SliceView, per_x),        HERE(SliceView, per_y)};
    EXPECT_EQ(on_device(writes("SliceView", {"width", "height", "slices", "orthographic", "behind", "centre_x", "centre_y", "low_x",
                                             "low_y", "per_x", "per_y"}),
                        host.size()),
              host);
    EXPECT_EQ(sizeof(SliceView), 11 * 4u); // every member is listed
}

TEST(SharedStructs, OcclusionPlane)
{
    const std::vector<cl_int> host = {sizeof(OcclusionPlane),          HERE(OcclusionPlane, slice),   HERE(OcclusionPlane, layer),
                                      HERE(OcclusionPlane, levels),    HERE(OcclusionPlane, at_x),    HERE(OcclusionPlane, at_y),
                                      HERE(OcclusionPlane, half_x),    HERE(OcclusionPlane, half_y),  HERE(OcclusionPlane, far),
                                      HERE(OcclusionPlane, fade_from), HERE(OcclusionPlane, per_fade)};
    EXPECT_EQ(on_device(writes("OcclusionPlane",
                               {"slice", "layer", "levels", "at_x", "at_y", "half_x", "half_y", "far", "fade_from", "per_fade"}),
                        host.size()),
              host);
    EXPECT_EQ(sizeof(OcclusionPlane), 10 * 4u); // every member is listed
}

TEST(SharedStructs, OcclusionLevel)
{
    const std::vector<cl_int> host = {sizeof(OcclusionLevel),       HERE(OcclusionLevel, width), HERE(OcclusionLevel, height),
                                      HERE(OcclusionLevel, stride), HERE(OcclusionLevel, rows),  HERE(OcclusionLevel, scale),
                                      HERE(OcclusionLevel, shift),  HERE(OcclusionLevel, offset)};
    EXPECT_EQ(on_device(writes("OcclusionLevel", {"width", "height", "stride", "rows", "scale", "shift", "offset"}), host.size()), host);
    EXPECT_EQ(sizeof(OcclusionLevel), 7 * 4u); // every member is listed
}

TEST(SharedStructs, OcclusionLight)
{
    const std::vector<cl_int> host = {sizeof(OcclusionLight),       HERE(OcclusionLight, centre_x),     HERE(OcclusionLight, centre_y),
                                      HERE(OcclusionLight, zero_x), HERE(OcclusionLight, zero_y),       HERE(OcclusionLight, share),
                                      HERE(OcclusionLight, first),  HERE(OcclusionLight, orthographic), HERE(OcclusionLight, planes),
                                      HERE(OcclusionLight, taps_x), HERE(OcclusionLight, taps_y),       HERE(OcclusionLight, combine)};
    EXPECT_EQ(on_device(writes("OcclusionLight", {"centre_x", "centre_y", "zero_x", "zero_y", "share", "first", "orthographic", "planes",
                                                  "taps_x", "taps_y", "combine"}),
                        host.size()),
              host);
    EXPECT_EQ(sizeof(OcclusionLight), 11 * 4u); // every member is listed
}

TEST(SharedStructs, SmoothieView)
{
    const std::vector<std::string> members = {"width",       "height", "left",         "top",    "step_x",    "step_y",
                                              "fixed_width", "light",  "orthographic", "groups", "two_sided", "sinusoidal"};
    const std::vector<cl_int> host = {
        sizeof(SmoothieView),          HERE(SmoothieView, width),        HERE(SmoothieView, height), HERE(SmoothieView, left),
        HERE(SmoothieView, top),       HERE(SmoothieView, step_x),       HERE(SmoothieView, step_y), HERE(SmoothieView, fixed_width),
        HERE(SmoothieView, light),     HERE(SmoothieView, orthographic), HERE(SmoothieView, groups), HERE(SmoothieView, two_sided),
        HERE(SmoothieView, sinusoidal)};
    EXPECT_EQ(on_device(writes("SmoothieView", members), host.size()), host);
    EXPECT_EQ(sizeof(SmoothieView), 12 * 4u);
}

TEST(SharedStructs, Constants)
{
    const std::vector<cl_int> host = {TILE_WIDTH, BLOCK, 0x7f7fffff, WEDGE_GROUP, SMOOTHIE_GROUP}; // the largest float
    EXPECT_EQ(
        on_device("    out[0] = TILE_WIDTH; out[1] = BLOCK; out[2] = as_int(NO_RECEIVER); out[3] = WEDGE_GROUP; out[4] = SMOOTHIE_GROUP;\n",
                  5),
        host);
    EXPECT_EQ(NO_RECEIVER, std::numeric_limits<float>::max());
}

} // namespace
} // namespace penumbra::test
