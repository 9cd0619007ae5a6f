// Every technique over awkward sizes with guard tails around every buffer: nothing is written past its end, and no value that was never
// written reaches a mask.
#include "support/device_run.hpp"
#include "support/maps.hpp"

#include "technique/occlusion_texture_run.hpp"
#include "technique/shadow_map.hpp"

namespace penumbra::test {
namespace {

struct Size {
    int width, height;
};
constexpr Size sizes[] = {{1, 1}, {1, 61}, {61, 1}, {7, 93}, {93, 7}, {128, 129}};

void expect_visibility(const std::vector<float>& mask, const std::string& what)
{
    for (const float v : mask) ASSERT_TRUE(v >= 0 && v <= 1) << what << ": " << v;
}

TEST(Canary, SoftShadowMap)
{
    const auto context = device_context(true);
    for (const Size occluders : sizes)
        for (const Size receivers : {sizes[0], sizes[3], sizes[4]})
            for (const int resolution : {0, 5}) {
                SoftCase c{.front = random_map(occluders.width, occluders.height, 1, 4, 0.3, 1),
                           .back = random_map(occluders.width, occluders.height, 2, 5, 0.3, 2),
                           .settings = {.visibility = PatchVisibility::sum, .sides = Sides::both, .resolution = resolution},
                           .receivers = random_map(receivers.width, receivers.height, 3, 9, 0.1, 3),
                           .camera = {}};
                SoftRun r;
                ASSERT_NO_THROW(r = run(context, c)) << occluders.width << " x " << occluders.height;
                expect_visibility(r.visibility, std::to_string(occluders.width) + " x " + std::to_string(occluders.height));
            }
}

TEST(Canary, EveryAccumulatorAndReduction)
{
    const auto context = device_context(true);
    for (const Accumulator accumulator : {Accumulator::binary32, Accumulator::compensated, Accumulator::binary16})
        for (const Reduction reduction : {Reduction::area, Reduction::nearest}) {
            SoftCase c{.front = random_map(61, 93, 1, 4, 0.3, 1),
                       .back = {},
                       .settings = {.visibility = PatchVisibility::sum, .sides = Sides::front, .resolution = 31, .reduction = reduction, .accumulator = accumulator},
                       .receivers = random_map(33, 15, 3, 9, 0.1, 3),
                       .camera = {}};
            SoftRun r;
            ASSERT_NO_THROW(r = run(context, c));
            expect_visibility(r.visibility, "accumulator");
        }
}

TEST(Canary, ShadowMap)
{
    const auto context = device_context(true);
    const LightFrame light = light_frame(rectangle_light(0, 0));
    const Camera view = light_camera(light_frame(point_light()), {1, 1}, {0, 0, 0});
    for (const Size occluders : sizes)
        for (const ShadowMap& settings :
             {ShadowMap{}, ShadowMap{.filter = ShadowFilter::percentage_closer, .taps = 63},
              ShadowMap{.filter = ShadowFilter::percentage_closer, .taps = 4}, ShadowMap{.filter = ShadowFilter::bicubic}}) {
            opencl::Work work(context);
            const DepthMap front = random_map(occluders.width, occluders.height, 1, 4, 0.3, 1), depth = random_map(17, 9, 3, 9, 0.1, 3);
            const auto front_buffer = work.upload(std::span<const float>(front.depth), "front");
            const auto depth_buffer = work.upload(std::span<const float>(depth.depth), "receivers");
            const OccluderDepth occluder_depth{.light = light,
                                               .camera = view,
                                               .width = front.width,
                                               .height = front.height,
                                               .precision = front.precision,
                                               .front = front_buffer.memory(),
                                               .back = {},
                                .layers = {}};
            const PreparedShadowMap prepared = prepare_shadow_map(work, occluder_depth, settings);
            const ReceiverPoints points =
                receiver_points(work, receiver_view(view, depth.width, depth.height, view), depth_buffer.memory(), depth.precision);
            const auto visibility = work.buffer<float>(depth.depth.size(), "visibility");
            shade_shadow_map(work, prepared, points, visibility.memory());
            expect_visibility(work.read(visibility), "shadow_map");
            EXPECT_NO_THROW(work.finish());
        }
}

TEST(Canary, OcclusionTexture)
{
    const auto context = device_context(true);
    const Light sun = DirectionalLight{.direction = {0, 0, -1}, .angular_diameter_deg = 5, .up = Vec3(0, 1, 0)};
    for (const int resolution : {4, 7, 31, 64})
        for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap, Prefilter::summed_area})
            for (const LevelStorage storage : {LevelStorage::binary32, LevelStorage::normalized16})
                for (const Light& light : {Light(rectangle_light(1, 0.3)), sun})
                    for (const Size size : {sizes[0], sizes[3], sizes[4]}) {
                        // One slice and 64; triangles that reach over the whole window and beyond the light's plane; a solid of awkward
                        // maps.
                        SliceCase c{.light = light,
                                    .casters = {triangles_in(30, {-2, -2, 3}, {2, 2, 6}, 1, 1), sheet(-3, 3, -3, 3, 5),
                                                mesh_of({{-1, -1, -30}, {1, 0, 8}, {0, 1, 8}}, {{0, 1, 2}})},
                                    .settings = {.slices = size.width == 1 ? 1 : 64,
                                                 .resolution = resolution,
                                                 .prefilter = prefilter,
                                                 .storage = storage,
                                                 .combine = size.width == 7 ? Combine::layered : Combine::product},
                                    .receivers = random_map(size.width, size.height, 3, 9, 0.1, 3),
                                    .camera = light_camera(light_frame(point_light()), {1, 1}, {0, 0, 0}),
                                    .solid = std::pair{random_map(size.width, size.height, 1, 4, 0.3, 1),
                                                       random_map(size.width, size.height, 2, 5, 0.3, 2)},
                                    .solid_camera = light_camera(light_frame(light), {1, 1}, {0, 0, 0})};
                        SliceRun r;
                        ASSERT_NO_THROW(r = run(context, c)) << resolution << " texels, " << size.width << " x " << size.height;
                        expect_visibility(r.visibility, "occlusion_texture, " + std::to_string(resolution));
                    }
}

TEST(Canary, SampleMask)
{
    const auto context = device_context(true);
    const Camera view = light_camera(light_frame(point_light()), {1, 1}, {0, 0, 0});
    for (const Size mask : sizes)
        for (const Size size : sizes) {
            opencl::Work work(context);
            const DepthMap depth = random_map(size.width, size.height, 3, 9, 0.2, 3);
            const auto depth_buffer = work.upload(std::span<const float>(depth.depth), "receivers");
            const ReceiverPoints points =
                receiver_points(work, receiver_view(view, size.width, size.height, view), depth_buffer.memory(), depth.precision);
            const std::vector<float> half(static_cast<std::size_t>(mask.width * mask.height), 0.5f);
            const auto mask_buffer = work.upload(std::span<const float>(half), "mask");
            const auto visibility = work.buffer<float>(depth.depth.size(), "visibility");
            sample_mask(work, points, mask_buffer.memory(), mask.width, mask.height, visibility.memory());
            const auto sampled = work.read(visibility);
            for (std::size_t i = 0; i < sampled.size(); ++i) EXPECT_EQ(sampled[i], std::isfinite(depth.depth[i]) ? 0.5f : 1.0f);
            EXPECT_NO_THROW(work.finish());
        }
}

} // namespace
} // namespace penumbra::test
