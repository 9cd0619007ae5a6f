// Depth and visibility in device buffers, in the caller's own context and on the caller's own queue.
#include "support/maps.hpp"

#include "opencl/devices.hpp"

namespace penumbra::test {
namespace {

// What a caller brings.
struct Caller {
    cl::Device device = opencl::choose_device("").device;
    cl::Context context{device};
    cl::CommandQueue queue{context, device};
    Engine engine{context(), device()};

    cl::Buffer upload(const DepthMap& map) const
    {
        std::vector<float> depth = map.depth;
        return {context, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, depth.size() * sizeof(float), depth.data()};
    }
    cl::Buffer room(std::size_t count) const { return {context, CL_MEM_WRITE_ONLY, count * sizeof(float)}; }
    std::vector<float> read(const cl::Buffer& buffer, std::size_t count) const
    {
        std::vector<float> values(count);
        queue.enqueueReadBuffer(buffer, CL_TRUE, 0, count * sizeof(float), values.data());
        return values;
    }
};

const RectangleLight light = rectangle_light(0.4, 0.2);

Object quad() { return {.name = "quad", .mesh = {.positions = {{-1, -1, -3}, {1, -1, -3}, {1, 1, -3}}, .triangles = {{0, 1, 2}}}}; }

TEST(DeviceBuffers, GiveTheSameBitsAsMapsInMemory)
{
    const Caller caller;
    const DepthMap front = random_map(61, 33, 2, 4, 0.4, 1), back = random_map(61, 33, 3, 5, 0.4, 2),
                   depth = random_map(45, 37, 5, 9, 0.1, 3);
    const cl::Buffer front_buffer = caller.upload(front), back_buffer = caller.upload(back), depth_buffer = caller.upload(depth);
    const PinholeCamera beside{.frame = {.origin = {0.5, 0.25, 0}}, .tan_half_fov = {0.8, 0.6}};

    // Buffers are shaded whole.
    for (const Technique& technique : {Technique(SoftShadowMap{.tolerance = 0}), Technique(SoftShadowMap{.sides = Sides::back, .resolution = 17, .tolerance = 0}),
                                       Technique(ShadowMap{.filter = ShadowFilter::bicubic})})
        for (const CameraSpec& camera : {CameraSpec(light_view()), CameraSpec(beside)}) {
            Occluders o = occluders(light_view(), front);
            o.back = back;
            const Engine own;
            const Mask expected = own.shade(own.prepare(light, o, technique), receivers(camera, depth));

            const Prepared prepared = caller.engine.prepare(
                light, DeviceOccluders{.camera = light_view(), .width = 61, .height = 33, .front = front_buffer(), .back = back_buffer()},
                technique);
            const cl::Buffer visibility = caller.room(depth.depth.size());
            caller.engine.shade(prepared, DeviceReceivers{.camera = camera, .width = 45, .height = 37, .depth = depth_buffer()},
                                visibility(), caller.queue());
            EXPECT_EQ(caller.read(visibility, depth.depth.size()), expected.visibility.pixels);

            // Prepared from buffers, shaded to memory, on the caller's context, and the other way round.
            EXPECT_EQ(caller.engine.shade(prepared, receivers(camera, depth)).visibility.pixels, expected.visibility.pixels);
        }
}

// Several shades queued after each other, before anything is waited for.
TEST(DeviceBuffers, WorkQueuesUp)
{
    const Caller caller;
    const Prepared prepared =
        caller.engine.prepare(light, occluders(light_view(), random_map(64, 64, 2, 4, 0.4, 1)), SoftShadowMap{.sides = Sides::front});
    std::vector<cl::Buffer> depths, masks;
    std::vector<DepthMap> maps;
    for (std::uint32_t i = 0; i < 6; ++i) {
        maps.push_back(random_map(64, 64, 5, 9, 0.1, 10 + i));
        depths.push_back(caller.upload(maps.back()));
        masks.push_back(caller.room(64 * 64));
    }
    for (std::size_t i = 0; i < maps.size(); ++i)
        caller.engine.shade(prepared, DeviceReceivers{.camera = light_view(), .width = 64, .height = 64, .depth = depths[i]()}, masks[i](),
                            caller.queue());
    for (std::size_t i = 0; i < maps.size(); ++i)
        EXPECT_EQ(caller.read(masks[i], 64 * 64), caller.engine.shade(prepared, receivers(light_view(), maps[i])).visibility.pixels) << i;
}

TEST(DeviceBuffers, DepthThatIsNothing)
{
    const Caller caller;
    DepthMap odd = flat(4, 2, 3), clean = odd;
    odd.depth = {std::numeric_limits<float>::quiet_NaN(), -1, 0, -0.0f, nothing_there, -nothing_there, 3, 3};
    clean.depth = {nothing_there, nothing_there, nothing_there, nothing_there, nothing_there, nothing_there, 3, 3};
    std::vector<std::vector<float>> masks;
    for (const DepthMap& map : {odd, clean}) {
        const cl::Buffer buffer = caller.upload(map), depth = caller.upload(flat(16, 16, 6)), mask = caller.room(256);
        const Prepared prepared =
            caller.engine.prepare(light, DeviceOccluders{.camera = light_view(), .width = 4, .height = 2, .front = buffer()},
                                  SoftShadowMap{.sides = Sides::front});
        caller.engine.shade(prepared, DeviceReceivers{.camera = light_view(), .width = 16, .height = 16, .depth = depth()}, mask(),
                            caller.queue());
        masks.push_back(caller.read(mask, 256));
    }
    EXPECT_EQ(masks[0], masks[1]);
    EXPECT_LT(*std::min_element(masks[0].begin(), masks[0].end()), 1.0f);
}

TEST(DeviceBuffers, WrongCallsAreRefused)
{
    const Caller caller;
    const DepthMap map = flat(8, 8, 2);
    const cl::Buffer depth = caller.upload(map), mask = caller.room(64), small = caller.room(63);
    const SoftShadowMap front{.sides = Sides::front};
    const auto occluder = [&](cl_mem f, cl_mem b, int width = 8) {
        return DeviceOccluders{.camera = light_view(), .width = width, .height = 8, .front = f, .back = b};
    };
    const auto expect_prepare = [&](const DeviceOccluders& o, const Technique& technique, ErrorCode code, const std::string& part) {
        const Error error = error_of([&] { caller.engine.prepare(light, o, technique); });
        EXPECT_EQ(error.code(), code) << error.what();
        EXPECT_TRUE(holds(error.what(), part)) << error.what();
    };
    expect_prepare(occluder(nullptr, nullptr), front, ErrorCode::usage, "occluders.front");
    expect_prepare(occluder(depth(), nullptr), SoftShadowMap{}, ErrorCode::usage, "occluders.back");
    expect_prepare(occluder(depth(), nullptr, 9), front, ErrorCode::usage, "288"); // bytes that 9 x 8 floats need
    expect_prepare(occluder(depth(), nullptr, 0), front, ErrorCode::usage, "occluders.front");
    expect_prepare(occluder(depth(), nullptr), RayTraced{}, ErrorCode::usage, "ray_traced");
    // Not looked at when the technique does not need it.
    EXPECT_NO_THROW(caller.engine.prepare(light, occluder(nullptr, depth()), SoftShadowMap{.sides = Sides::back}));

    const Prepared prepared = caller.engine.prepare(light, occluder(depth(), nullptr), front);
    const auto expect_shade = [&](const Prepared& p, cl_mem d, cl_mem v, cl_command_queue queue, ErrorCode code, const std::string& part) {
        const Error error =
            error_of([&] { caller.engine.shade(p, {.camera = light_view(), .width = 8, .height = 8, .depth = d}, v, queue); });
        EXPECT_EQ(error.code(), code) << error.what();
        EXPECT_TRUE(holds(error.what(), part)) << error.what();
    };
    expect_shade(prepared, nullptr, mask(), caller.queue(), ErrorCode::usage, "receivers.depth");
    expect_shade(prepared, depth(), nullptr, caller.queue(), ErrorCode::usage, "visibility");
    expect_shade(prepared, depth(), small(), caller.queue(), ErrorCode::usage, "252");
    expect_shade(prepared, depth(), mask(), nullptr, ErrorCode::usage, "queue");
    const cl::Context other(caller.device);
    const cl::CommandQueue foreign(other, caller.device);
    expect_shade(prepared, depth(), mask(), foreign(), ErrorCode::usage, "queue");

    const Prepared projecting =
        caller.engine.prepare(light, occluder(depth(), nullptr), SoftShadowMap{.sides = Sides::front, .project = true});
    expect_shade(projecting, depth(), mask(), caller.queue(), ErrorCode::unsupported, "project");
    Scene scene{.light = light, .objects = {quad()}, .occluders = {}, .receivers = {}, .technique = {}, .output = {}, .warnings = {}};
    expect_shade(caller.engine.prepare(scene, RayTraced{}), depth(), mask(), caller.queue(), ErrorCode::unsupported, "ray_traced");
}

} // namespace
} // namespace penumbra::test
