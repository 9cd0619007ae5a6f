// Guard tails: a kernel that writes past its buffer is found out.
#include <cmath>

#include "fixture.hpp"

namespace penumbra::opencl::test {
namespace {

constexpr const char* kernels = R"(
__kernel void fill(const int from, const int to, __global float* out)
{
    for (int i = from; i < to; ++i) out[i] = 1.0f;
}
)";

struct Guarded : Device {
    Guarded() { context->canaries = true; }

    void fill(Work& work, int from, int to, const Buffer<float>& out)
    {
        work.launch(kernel(kernels, "fill"), "fill", {1, 1}, {1, 1}, 0, from, to, out);
    }
};

// Sizes whose end is aligned and not.
constexpr std::size_t sizes[] = {1, 7, 61, 93, 256};

TEST(Canary, WholeBufferIsFine)
{
    Guarded device;
    Work work(device.context);
    for (const std::size_t size : sizes) {
        const auto out = work.buffer<float>(size, "out");
        device.fill(work, 0, static_cast<int>(size), out);
        EXPECT_EQ(work.read(out), std::vector<float>(size, 1.0f));
    }
    EXPECT_NO_THROW(work.finish());
}

TEST(Canary, FoundWhenReading)
{
    Guarded device;
    for (const std::size_t size : sizes) {
        Work work(device.context);
        const auto out = work.buffer<float>(size, "the visibility");
        const int end = static_cast<int>(size);
        device.fill(work, end, end + 1, out); // one element
        const Error error = error_of([&] { work.read(out); });
        EXPECT_EQ(error.code(), ErrorCode::internal);
        EXPECT_TRUE(holds(error.message(), "the visibility (" + std::to_string(4 * size) + " bytes): 4 of the 256")) << error.what();
        EXPECT_TRUE(holds(error.message(), "first at +0")) << error.what();
    }
}

TEST(Canary, FoundAtTheEnd)
{
    Guarded device;
    Work work(device.context);
    const auto out = work.buffer<float>(7, "out");
    device.fill(work, 7 + 63, 7 + 64, out); // the last element of the tail
    const Error error = error_of([&] { work.finish(); });
    EXPECT_EQ(error.code(), ErrorCode::internal);
    EXPECT_TRUE(holds(error.message(), "first at +252")) << error.what();
}

TEST(Canary, FoundAfterDropping)
{
    Guarded device;
    Work work(device.context);
    {
        const auto out = work.buffer<float>(7, "the temporary");
        device.fill(work, 7, 8, out);
    }
    const Error error = error_of([&] { work.finish(); });
    EXPECT_EQ(error.code(), ErrorCode::internal);
    EXPECT_TRUE(holds(error.message(), "the temporary")) << error.what();
    EXPECT_NO_THROW(work.finish()); // told once
}

TEST(Canary, EmptyBuffer)
{
    Guarded device;
    Work work(device.context);
    const auto out = work.buffer<float>(0, "nothing");
    device.fill(work, 0, 1, out);
    EXPECT_EQ(error_of([&] { work.read(out); }).code(), ErrorCode::internal);
}

// What nobody wrote reads as NaN.
TEST(Canary, UnwrittenElementsAreNotNumbers)
{
    Guarded device;
    Work work(device.context);
    const auto out = work.buffer<float>(7, "out");
    device.fill(work, 0, 6, out);
    const auto values = work.read(out);
    EXPECT_EQ(values[5], 1.0f);
    EXPECT_TRUE(std::isnan(values[6]));
}

} // namespace
} // namespace penumbra::opencl::test
