// The device's own limits, measured in the same run as what the kernels reach of them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "cases.hpp"
#include "opencl/context.hpp"
#include "rows.hpp"

namespace penumbra::bench {
namespace {

// Eight independent chains of fused multiply-adds on vectors as wide as the kernels': bound by arithmetic alone.
constexpr const char* source = R"(
#define CHAIN(v) v = fma(v, a, b)
__kernel void multiply_add(__global float* out, const float seed, const int rounds)
{
    const float16 a = (float16)(seed), b = (float16)(1.0f - seed);
    float16 s0 = (float16)(get_global_id(0)), s1 = s0 + 1.0f, s2 = s0 + 2.0f, s3 = s0 + 3.0f, s4 = s0 + 4.0f, s5 = s0 + 5.0f, s6 = s0 + 6.0f, s7 = s0 + 7.0f;
    for (int i = 0; i < rounds; ++i) { CHAIN(s0); CHAIN(s1); CHAIN(s2); CHAIN(s3); CHAIN(s4); CHAIN(s5); CHAIN(s6); CHAIN(s7); }
    vstore16(s0 + s1 + s2 + s3 + s4 + s5 + s6 + s7, get_global_id(0), out);
}
__kernel void copy(__global const float16* from, __global float16* to) { to[get_global_id(0)] = from[get_global_id(0)]; }
)";

double best_ms(const cl::CommandQueue& queue, const cl::Kernel& kernel, std::size_t items)
{
    double best = 1e30;
    for (int run = 0; run < 10; ++run) {
        cl::Event event;
        queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(items), cl::NDRange(64), nullptr, &event);
        event.wait();
        const double ns =
            static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() - event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
        best = std::min(best, ns * 1e-6);
    }
    return best;
}

// A flat occluder map that covers the view, a light so large that every texel reaches every receiver: nothing but the inner loop.
Report dense_pairs(const Engine& engine)
{
    const RectangleLight light{.center = {0, 0, 0}, .half_u = {50, 0, 0}, .half_v = {0, 0, -50}, .emission = {}};
    const LightCamera view{.tan_half_fov = Vec2(0.5, 0.5), .half_extent = {}, .center = {}};
    const int texels = 32, receivers = 512;
    Occluders occluders{.camera = view, .width = texels, .height = texels, .front = {}, .back = {}, .layers = {}};
    occluders.front = DepthMap{.width = texels, .height = texels, .depth = std::vector<float>(texels * texels, 5.0f)};
    Receivers points{.camera = view, .width = receivers, .height = receivers, .depth = {}};
    points.depth = DepthMap{.width = receivers, .height = receivers, .depth = std::vector<float>(receivers * receivers, 8.0f)};

    const Prepared prepared = engine.prepare(light, occluders, SoftShadowMap{.visibility = PatchVisibility::sum, .sides = Sides::front, .tolerance = 0});
    Report best = engine.shade(prepared, points).report;
    const auto kernel_ms = [](const Report& r) {
        return std::find_if(r.stages.begin(), r.stages.end(), [](const Stage& s) { return s.name == "shade"; })->device_ms;
    };
    for (int run = 0; run < 10; ++run) {
        const Report report = engine.shade(prepared, points).report;
        if (kernel_ms(report) < kernel_ms(best)) best = report;
    }
    best.total_ms = kernel_ms(best);
    return best;
}

struct Rates {
    double gflops = 0, gigabytes = 0;
};

Rates rates_of(const Engine& engine)
{
    const auto context = opencl::Context::open(std::to_string(engine.device().index));
    const cl::CommandQueue queue = context->queue();
    cl::Program program(context->context(), source);
    program.build({context->device()}, "-cl-std=CL1.2");

    constexpr int rounds = 20000;
    constexpr std::size_t items = 1024, copied = std::size_t{1} << 22;
    const cl::Buffer a(context->context(), CL_MEM_READ_WRITE, copied * 64), b(context->context(), CL_MEM_READ_WRITE, copied * 64);
    queue.enqueueFillBuffer(a, 0.0f, 0, copied * 64);
    cl::Kernel arithmetic(program, "multiply_add"), memory(program, "copy");
    arithmetic.setArg(0, a);
    arithmetic.setArg(1, 0.5f);
    arithmetic.setArg(2, rounds);
    memory.setArg(0, a);
    memory.setArg(1, b);
    return {.gflops = 2.0 * 16 * 8 * rounds * items / best_ms(queue, arithmetic, items) * 1e-6,
            .gigabytes = 2.0 * copied * 64 / best_ms(queue, memory, copied) * 1e-6};
}

} // namespace

double copy_rate(const Engine& engine) { return rates_of(engine).gigabytes; }

void limits(const Engine& engine)
{
    const auto [gflops, gigabytes] = rates_of(engine);

    const Report dense = dense_pairs(engine);
    const double pairs_per_s = static_cast<double>(dense.pairs) / (dense.total_ms * 1e-3);
    // Of one pair: 3 subtractions and 1 division for the reach, 2 multiplications for the scales, 4 fused multiply-adds (2 each), 8
    // comparisons for the four saturations, 2 subtractions, 1 comparison and 1 selection, 1 multiplication, 1 fused multiply-add: 29.
    constexpr double operations = 29;
    std::printf(
        "# fused multiply-add %.1f GFLOP/s, copy %.1f GB/s (read and write), inner loop %.3g pairs/s: %.0f operations each, %.0f %% of the "
        "arithmetic limit\n",
        gflops, gigabytes, pairs_per_s, operations, 100 * pairs_per_s * operations * 1e-9 / gflops);
}

} // namespace penumbra::bench
