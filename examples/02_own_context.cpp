// 02: the scene of 01 in the caller's own OpenCL context, from device buffers to a device buffer.
//
// Expected: mean visibility 0.7500
#include <cstdio>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include <penumbra/penumbra.hpp>

namespace {

void check(cl_int status, const char* call)
{
    if (status != CL_SUCCESS) throw std::runtime_error(std::string(call) + " failed with " + std::to_string(status));
}

constexpr int size = 256;
constexpr std::size_t pixels = std::size_t{size} * size;

cl_mem buffer(cl_context context, const std::vector<float>& values)
{
    cl_int status = 0;
    cl_mem memory = clCreateBuffer(context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, values.size() * sizeof(float),
                                   const_cast<float*>(values.data()), &status); // copied, not written
    check(status, "clCreateBuffer");
    return memory;
}

void run()
{
    // What an application that computes on the device already has.
    cl_platform_id platform = nullptr;
    cl_device_id device = nullptr;
    cl_int status = 0;
    check(clGetPlatformIDs(1, &platform, nullptr), "clGetPlatformIDs");
    check(clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 1, &device, nullptr), "clGetDeviceIDs");
    cl_context context = clCreateContext(nullptr, 1, &device, nullptr, nullptr, &status);
    check(status, "clCreateContext");
    cl_command_queue queue = clCreateCommandQueue(context, device, 0, &status);
    check(status, "clCreateCommandQueue");

    std::vector<float> square(pixels, penumbra::nothing_there);
    for (int y = size / 4; y < size * 3 / 4; ++y)
        for (int x = size / 4; x < size * 3 / 4; ++x) square[static_cast<std::size_t>(y * size + x)] = 4;
    cl_mem occluders = buffer(context, square);
    cl_mem receivers = buffer(context, std::vector<float>(pixels, 6.0f));
    cl_mem visibility = buffer(context, std::vector<float>(pixels, 0.0f));

    {
        // What penumbra adds: it keeps references to the context, not copies of the buffers.
        const penumbra::Engine engine(context, device);
        const penumbra::Light light =
            penumbra::RectangleLight{.center = {0, 6, 0}, .half_u = {0.5, 0, 0}, .half_v = {0, 0, -0.5}, .emission = {}};
        const penumbra::LightCamera camera{.tan_half_fov = penumbra::Vec2(0.5, 0.5), .half_extent = {}, .center = {}};
        const penumbra::Prepared prepared = engine.prepare(
            light, penumbra::DeviceOccluders{.camera = camera, .width = size, .height = size, .front = occluders, .back = nullptr},
            penumbra::SoftShadowMap{.sides = penumbra::Sides::front});
        engine.shade(prepared, penumbra::DeviceReceivers{.camera = camera, .width = size, .height = size, .depth = receivers}, visibility,
                     queue);
    }

    std::vector<float> mask(pixels);
    check(clEnqueueReadBuffer(queue, visibility, CL_TRUE, 0, pixels * sizeof(float), mask.data(), 0, nullptr, nullptr),
          "clEnqueueReadBuffer");
    std::printf("mean visibility %.4f\n", std::accumulate(mask.begin(), mask.end(), 0.0) / pixels);

    for (cl_mem memory : {occluders, receivers, visibility}) clReleaseMemObject(memory);
    clReleaseCommandQueue(queue);
    clReleaseContext(context);
}

} // namespace

int main()
try {
    run();
} catch (const std::exception& error) {
    std::fprintf(stderr, "02_own_context: %s\n", error.what());
    return 1;
}
