// How shares are summed: binary16 as the hardware of 2006 did, binary32, compensated (Soft Shadow Maps, Appendix A).
#include <cstring>

#include "support/device_run.hpp"
#include "support/maps.hpp"

#include "opencl/kernel_files.hpp"
#include "opencl/program_cache.hpp"

namespace penumbra::test {
namespace {

// --- Rounding to binary16 ------------------------------------------------------------------------------------------------------------

// Counts where round_to_half and the device's own vstore_half disagree, and gives the last such value. Compiled from the embedded text of
// the kernels' headers.
std::string rounding_kernel(int lanes)
{
    const std::string text = "#define LANES " + std::to_string(lanes) + "\n" + std::string(opencl::kernel_file("common/lanes.clh")) + "\n" +
                             std::string(opencl::kernel_file("common/half_rounding.clh"));
    return text + R"(
__kernel void compare(const int count, __global const float* x, __global half* stored, __global int* wrong, __global float* which)
{
    const int at = get_global_id(0) * LANES;
    if (at >= count) return;
    float rounded[LANES];
    store_lanes(round_to_half(load_lanes(x + at)), rounded);
    for (int i = 0; i < LANES; ++i) {
        vstore_half_rte(x[at + i], at + i, stored);
        if (as_uint(rounded[i]) == as_uint(vload_half(at + i, stored))) continue;
        atomic_inc(wrong);
        *which = x[at + i];
    }
}
)";
}

void expect_same_rounding(const std::vector<float>& values, const std::string& what)
{
    const auto context = device_context();
    opencl::ProgramCache programs(context->context(), context->device(), "");
    for (const int lanes : {1, 8, 16}) {
        std::vector<float> padded = values;
        while (padded.size() % 16 != 0) padded.push_back(0);
        double compile_ms = 0;
        opencl::Work work(context);
        const auto x = work.upload(std::span<const float>(padded), "values");
        const auto stored = work.buffer<cl_half>(padded.size(), "halves");
        const auto wrong = work.upload(std::span<const cl_int>(std::vector<cl_int>(1)), "wrong");
        const auto which = work.upload(std::span<const float>(std::vector<float>(1)), "which");
        work.launch(cl::Kernel(programs.program("rounding", rounding_kernel(lanes), compile_ms), "compare"), "compare",
                    {padded.size() / static_cast<std::size_t>(lanes), 1}, {64, 1}, 0, static_cast<cl_int>(padded.size()), x, stored, wrong,
                    which);
        EXPECT_EQ(work.read(wrong)[0], 0) << what << ", " << lanes << " lanes, e.g. " << std::hexfloat << work.read(which)[0];
    }
}

// The value of a half-float's bits, for those that are finite and not negative.
float half_value(int bits)
{
    const int exponent = bits >> 10, mantissa = bits & 1023;
    return exponent == 0 ? std::ldexp(static_cast<float>(mantissa), -24) : std::ldexp(static_cast<float>(1024 + mantissa), exponent - 25);
}

TEST(RoundToHalf, EveryHalfAndTheMidpointsBetween)
{
    std::vector<float> values;
    for (int bits = 0; bits < 0x7c00; ++bits) {
        const float value = half_value(bits);
        values.push_back(value);
        if (bits == 0x7bff) break;
        // A midpoint has one bit more than a half and is exact in binary32; so are its neighbours.
        const float middle = (value + half_value(bits + 1)) / 2;
        values.insert(values.end(), {middle, std::nextafter(middle, 0.0f), std::nextafter(middle, 1e9f), std::nextafter(value, 1e9f)});
    }
    EXPECT_EQ(values.back(), 65504.0f);
    expect_same_rounding(values, "halves and midpoints");
}

TEST(RoundToHalf, RandomFloats)
{
    std::mt19937 random(7);
    // Bit patterns, so that every magnitude has its share, and values of the size that masks have.
    std::uniform_int_distribution<std::uint32_t> bits(0, 0x477fe000); // 65504
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<float> values;
    for (int i = 0; i < 1 << 21; ++i) {
        const std::uint32_t b = bits(random);
        float value = 0;
        std::memcpy(&value, &b, sizeof(value));
        values.push_back(value);
        values.push_back(unit(random));
    }
    expect_same_rounding(values, "random floats");
}

// --- Sums ----------------------------------------------------------------------------------------------------------------------------

// One receiver below a plane of n x n patches, half of the light wide each way from the middle: u = x / (width of the light's image).
// With tangent 1, the plane at z and the receiver at 2 z: K = k / (1 / z - 1 / 2z) = 2 z k, k = 1 / (2 half), and the whole map (2 wide in
// xi) is 2 z / half lights wide. half = z makes it 2 lights wide: patches are 2 / n of the light.
SoftCase plane_of_patches(int n, Accumulator accumulator)
{
    SoftCase c{.front = flat(n, n, 4),
               .back = {},
               .settings = {.visibility = PatchVisibility::sum, .sides = Sides::front, .accumulator = accumulator},
               .receivers = flat(1, 1, 8),
               .camera = {}};
    c.half_u = c.half_v = 4;
    return c;
}

double occlusion_of_patches(int n, Accumulator accumulator)
{
    return 1 - run(device_context(), plane_of_patches(n, accumulator)).visibility[0];
}

// Appendix A, Eq. 4: with patches 1/32 of the light wide every share is 2^-10. The sum of 2^-10 each is exact in binary16 until 1; with
// patches half as wide, shares of 2^-12 are lost as soon as the sum reaches 2^-1 (they are less than half a unit in its last place, 2^-11):
// the umbra comes out as 1/2.
TEST(Accumulator, Binary16LosesPatchesBelowA32ndOfTheLight)
{
    EXPECT_EQ(occlusion_of_patches(32, Accumulator::binary16), 1); // 1/16 of the light
    EXPECT_EQ(occlusion_of_patches(64, Accumulator::binary16), 1); // 1/32, the bound of Eq. 4
    EXPECT_EQ(occlusion_of_patches(128, Accumulator::binary16), 0.5);
    EXPECT_EQ(occlusion_of_patches(256, Accumulator::binary16), 0.125); // shares of 2^-14: lost from 2^-3 on
    for (const int n : {32, 64, 128, 256}) EXPECT_EQ(occlusion_of_patches(n, Accumulator::binary32), 1) << n;
}

// Shares of 2^-12 are also lost when the sum is not a power of two: any size above the bound is short by at most rounding, any far below by
// much.
TEST(Accumulator, Binary16AtOddSizes)
{
    const auto error = [](int n) { return std::abs(occlusion_of_patches(n, Accumulator::binary16) - 1); };
    // Below n = 64 no share is lost; each of at most n^2 / 4 additions rounds by 2^-12 (half a unit in the last place of a sum below 1).
    EXPECT_LE(error(23), 23 * 23 * 0x1p-12);
    // Above, the sum stalls where half a unit in its last place exceeds the share 4 / n^2.
    EXPECT_GT(error(150), 0.25);
}

// 45,000 equal shares, half the plane: the light is hidden up to u = 1/2 + (600 / 601 - 1). Neighbours share their edges, so that overlaps
// sum to that but for the last edge (7/2 e, e = 2^-24) and what each share rounds (e of itself per axis and for the product); the
// compensated sum adds 2 e and the result 1/2 e. Recursive binary32 drifts beyond that.
TEST(Accumulator, CompensatedDoesNotDrift)
{
    const double expected = 0.5 + (600 / 601.0 - 1), bound = 9 * 0x1p-24;
    const auto error = [&](Accumulator accumulator) {
        SoftCase c = plane_of_patches(601, accumulator);
        c.front = boxes(601, 601, 4, {{0, 300, 0, 601}});
        return std::abs(1 - run(device_context(), c).visibility[0] - expected);
    };
    EXPECT_LE(error(Accumulator::compensated), bound);
    EXPECT_GT(error(Accumulator::binary32), 10 * bound);
}

// Many small shares: each accumulator keeps its own bound, and the compensated one is the closer where both are measured.
TEST(Accumulator, CompensatedIsCloserThanBinary32)
{
    const auto context = device_context();
    double worst[2] = {0, 0};
    double sum[2] = {0, 0};
    for (const Accumulator accumulator : {Accumulator::binary32, Accumulator::compensated}) {
        SoftCase c{.front = random_map(151, 149, 3, 3.2, 0.1, 3),
                   .back = {},
                   .settings = {.visibility = PatchVisibility::sum, .sides = Sides::front, .accumulator = accumulator},
                   .receivers = flat(8, 8, 12),
                   .camera = {}};
        c.half_u = c.half_v = 3.9;
        const SoftRun r = run(context, c);
        for (std::size_t i = 0; i < r.points.size(); ++i) {
            const oracle::Bounded expected = oracle::visibility(r.maps, r.points[i], r.settings);
            const double error = std::abs(r.visibility[i] - expected.value);
            EXPECT_LE(error, expected.bound);
            const auto which = accumulator == Accumulator::compensated ? 1u : 0u;
            worst[which] = std::max(worst[which], error);
            sum[which] += error;
        }
    }
    EXPECT_LT(sum[1], sum[0]);
    EXPECT_LE(worst[1], worst[0]);
}

} // namespace
} // namespace penumbra::test
