// Buffers, launches and stages.
#include <thread>

#include "fixture.hpp"
#include "opencl/ledger.hpp"

namespace penumbra::opencl::test {
namespace {

// Kernels that guard their range, as all of ours do.
constexpr const char* kernels = R"(
typedef struct { float scale; int count; } Line;
__kernel void line(const Line line, const float offset, __global float* out)
{
    const int i = get_global_id(1) * get_global_size(0) + get_global_id(0);
    if (i < line.count) out[i] = line.scale * i + offset;
}
__kernel void copy(const int2 size, __global const float* in, __global float* out)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x < size.x && y < size.y) out[y * size.x + x] = in[y * size.x + x];
}
__kernel void shapes(__global int* out)
{
    if (get_global_id(0) + get_global_id(1) > 0) return;
    out[0] = get_global_size(0); out[1] = get_global_size(1);
    out[2] = get_local_size(0); out[3] = get_local_size(1);
    out[4] = get_global_offset(0); out[5] = get_global_offset(1);
}
__kernel void is_null(__global const float* maybe, __global int* out) { out[0] = maybe == 0; }
__kernel void spin(const int rounds, __global float* out)
{
    float x = out[get_global_id(0)];
    for (int i = 0; i < rounds; ++i) x = fma(x, 0.999f, 0.001f);
    out[get_global_id(0)] = x;
}
__kernel void much_local(__local float* room, __global float* out) { room[get_local_id(0)] = 1.0f; out[0] = room[0]; }
)";

struct Line {
    float scale;
    int count;
};

const Stage& stage_of(const std::vector<Stage>& stages, const std::string& name)
{
    for (const Stage& stage : stages) {
        if (stage.name == name) return stage;
    }
    ADD_FAILURE() << "no stage " << name;
    static const Stage none;
    return none;
}

std::vector<float> ramp(std::size_t count, float scale = 1)
{
    std::vector<float> values(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = scale * static_cast<float>(i);
    return values;
}

TEST(Work, UploadAndReadBack)
{
    Device device;
    Work work(device.context);
    for (const std::size_t count : {0, 1, 7, 61, 93, 4096}) {
        const auto data = ramp(count);
        const auto buffer = work.upload<float>(data, "data");
        EXPECT_TRUE(buffer);
        EXPECT_EQ(buffer.count(), count);
        EXPECT_EQ(work.read(buffer), data);
    }
}

// Sizes that are no multiple of the work-group's, one wide and one high.
TEST(Work, GlobalIsRoundedUpToWholeGroups)
{
    Device device;
    Work work(device.context);
    using Shape = std::array<std::size_t, 2>;
    for (const Shape size : {Shape{1, 1}, Shape{7, 61}, Shape{93, 1}, Shape{1, 93}, Shape{64, 4}}) {
        const auto in = work.upload<float>(ramp(size[0] * size[1]), "in");
        const auto out = work.buffer<float>(in.count(), "out");
        const cl_int2 extent = {{static_cast<int>(size[0]), static_cast<int>(size[1])}};
        work.launch(device.kernel(kernels, "copy"), "copy", size, {16, 4}, 2 * in.bytes(), extent, in, out);
        EXPECT_EQ(work.read(out), ramp(in.count())) << size[0] << " x " << size[1];
    }
    const auto shapes = work.buffer<int>(6, "shapes");
    work.launch(device.kernel(kernels, "shapes"), "shapes", {17, 5}, {16, 4}, 24, shapes);
    EXPECT_EQ(work.read(shapes), (std::vector<int>{32, 8, 16, 4, 0, 0}));
}

TEST(Work, NoItemsNoLaunch)
{
    Device device;
    Work work(device.context);
    const auto out = work.upload<float>(ramp(4), "out");
    work.launch(device.kernel(kernels, "line"), "line", {0, 1}, {16, 1}, 0, Line{9, 4}, 9.0f, out);
    EXPECT_EQ(work.read(out), ramp(4));
}

TEST(Work, ArgumentsOfEveryKind)
{
    Device device;
    Work work(device.context);
    const auto out = work.buffer<float>(5, "out");
    work.launch(device.kernel(kernels, "line"), "line", {5, 1}, {8, 1}, out.bytes(), Line{2.0f, 5}, 0.5f, out.memory());
    EXPECT_EQ(work.read(out), (std::vector<float>{0.5f, 2.5f, 4.5f, 6.5f, 8.5f}));

    const auto answer = work.buffer<int>(1, "answer");
    work.launch(device.kernel(kernels, "is_null"), "is_null", {1, 1}, {1, 1}, 4, Buffer<float>(), answer);
    EXPECT_EQ(work.read(answer), std::vector<int>{1});
}

// The driver does not look at the sizes of structs; scalars, vectors and pointers it does.
TEST(Work, WrongArgumentsNameKernelAndIndex)
{
    Device device;
    Work work(device.context);
    const auto out = work.buffer<float>(5, "out");
    const Error size = error_of([&] { work.launch(device.kernel(kernels, "copy"), "copy", {1, 1}, {1, 1}, 0, cl_int2{}, out, cl_int4{}); });
    EXPECT_EQ(size.code(), ErrorCode::internal);
    EXPECT_TRUE(holds(size.message(), "kernel copy, argument 2 of 3, 16 bytes")) << size.what();
    EXPECT_TRUE(holds(size.message(), "CL_INVALID_ARG_SIZE (-51)")) << size.what();

    const Error vector = error_of([&] { work.launch(device.kernel(kernels, "copy"), "copy", {1, 1}, {1, 1}, 0, 1, out, out); });
    EXPECT_EQ(vector.code(), ErrorCode::internal);
    EXPECT_TRUE(holds(vector.message(), "kernel copy, argument 0 of 3, 4 bytes")) << vector.what();

    const Error many = error_of([&] { work.launch(device.kernel(kernels, "copy"), "copy", {1, 1}, {1, 1}, 0, cl_int2{}, out, out, 1); });
    EXPECT_EQ(many.code(), ErrorCode::internal);
    EXPECT_TRUE(holds(many.message(), "argument 3 of 3")) << many.what();

    const Error few = error_of([&] { work.launch(device.kernel(kernels, "copy"), "copy", {1, 1}, {1, 1}, 0, cl_int2{}, out); });
    EXPECT_EQ(few.code(), ErrorCode::internal);
    EXPECT_TRUE(holds(few.message(), "CL_INVALID_KERNEL_ARGS (-52)")) << few.what();
}

TEST(Work, UnknownKernelIsOurMistake)
{
    Device device;
    double compile_ms = 0;
    const Error error = error_of([&] { device.context->kernel({"occluders.cl", {}}, "no_such_kernel", compile_ms); });
    EXPECT_EQ(error.code(), ErrorCode::internal);
    EXPECT_TRUE(holds(error.message(), "occluders.cl, kernel no_such_kernel")) << error.what();
}

TEST(Work, GroupOverTheLimitHasTheNumbers)
{
    Device device;
    Work work(device.context);
    const auto out = work.buffer<float>(5, "out");
    const std::size_t limit = device.context->info().max_work_group;
    const auto launch = [&](std::array<std::size_t, 2> local) {
        work.launch(device.kernel(kernels, "line"), "line", {1, 1}, local, 0, Line{1, 5}, 0.0f, out);
    };

    for (const auto& local :
         {std::array<std::size_t, 2>{limit, 2}, std::array<std::size_t, 2>{limit + 1, 1}, std::array<std::size_t, 2>{limit, limit}}) {
        const Error error = error_of([&] { launch(local); });
        EXPECT_EQ(error.code(), ErrorCode::too_large);
        EXPECT_TRUE(holds(error.message(), "kernel line")) << error.what();
        EXPECT_TRUE(holds(error.message(), std::to_string(local[0]) + " x " + std::to_string(local[1]))) << error.what();
        EXPECT_TRUE(holds(error.message(), "limit of ")) << error.what();
    }
    EXPECT_EQ(error_of([&] { launch({0, 1}); }).code(), ErrorCode::internal);
    EXPECT_NO_THROW(launch({16, 1})); // and the work goes on
}

TEST(Work, BufferOverTheLimitHasTheNumbers)
{
    Device device;
    Work work(device.context);
    const std::uint64_t most = device.context->info().max_allocation_bytes;
    for (const std::size_t count : {static_cast<std::size_t>(most + 1), std::numeric_limits<std::size_t>::max()}) {
        const Error error = error_of([&] { work.buffer<char>(count, "the receivers"); });
        EXPECT_EQ(error.code(), ErrorCode::too_large);
        EXPECT_TRUE(holds(error.message(), "the receivers needs " + std::to_string(count) + " bytes")) << error.what();
        EXPECT_TRUE(holds(error.message(), std::to_string(most))) << error.what();
    }
    // Bytes that do not fit 64 bits.
    EXPECT_EQ(error_of([&] { work.buffer<double>(std::numeric_limits<std::size_t>::max() / 8 + 2, "x"); }).code(), ErrorCode::too_large);
    EXPECT_EQ(work.memory().live, 0u);
    EXPECT_EQ(device.context->ledger()->live(), 0u);
}

// Drivers may hand out more than there is.
TEST(Work, TotalOverTheDevicesMemory)
{
    Device device;
    Work work(device.context);
    const DeviceInfo& info = device.context->info();
    std::vector<Buffer<char>> buffers;
    const Error error = error_of([&] {
        for (std::uint64_t i = 0; i <= info.global_bytes / info.max_allocation_bytes; ++i) {
            buffers.push_back(work.buffer<char>(info.max_allocation_bytes, "one more"));
        }
    });
    EXPECT_EQ(error.code(), ErrorCode::too_large);
    EXPECT_TRUE(holds(error.message(), "one more needs " + std::to_string(info.max_allocation_bytes))) << error.what();
    EXPECT_LE(work.memory().live, info.global_bytes);
    EXPECT_TRUE(holds(error.message(), std::to_string(work.memory().live))) << error.what();
    buffers.clear();
    EXPECT_NO_THROW(work.buffer<char>(1024, "fits again"));
}

TEST(Work, MeterCountsLiveAndPeak)
{
    Device device;
    Work work(device.context);
    auto first = work.buffer<float>(1000, "first");
    EXPECT_EQ(work.memory().live, 4000u);
    {
        const auto second = work.buffer<float>(500, "second");
        EXPECT_EQ(work.memory().live, 6000u);
    }
    EXPECT_EQ(work.memory().live, 4000u);
    EXPECT_EQ(work.memory().peak, 6000u);
    auto moved = std::move(first);
    EXPECT_EQ(work.memory().live, 4000u);
    std::thread([gone = std::move(moved)] {}).join();
    EXPECT_EQ(work.memory().live, 0u);
    EXPECT_EQ(work.memory().peak, 6000u);
}

// Prepared state outlives the work that made it.
TEST(Work, BufferOutlivesItsWork)
{
    Device device;
    Buffer<float> kept;
    {
        Work work(device.context);
        kept = work.upload<float>(ramp(61), "kept");
    }
    EXPECT_EQ(device.context->ledger()->live(), 61u * 4);
    Work other(device.context);
    EXPECT_EQ(other.read(kept), ramp(61));
    kept = {};
    EXPECT_EQ(device.context->ledger()->live(), 0u);
}

TEST(Work, StagesHaveTimesAndBytes)
{
    Device device;
    Work work(device.context);
    work.stage("upload");
    const auto data = work.upload<float>(ramp(4096), "data");
    work.stage("shade");
    const auto spin = [&] { work.launch(device.kernel(kernels, "spin"), "spin", {4096, 1}, {64, 1}, 2 * data.bytes(), 20000, data); };
    spin();
    work.stage("read");
    work.read(data);
    work.stage("shade"); // joined with the first
    spin();
    const auto stages = work.finish();

    ASSERT_EQ(stages.size(), 4u); // upload, shade, read, and compile for the first launch
    EXPECT_EQ(stages[1].name, "shade");
    EXPECT_EQ(stages[0].bytes, 4096u * 4);
    EXPECT_EQ(stages[1].bytes, 4096u * 4 * 4);
    EXPECT_EQ(stages[2].bytes, 4096u * 4);
    EXPECT_EQ(stages[3].name, "compile");
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_GT(stages[i].device_ms, 0.0) << stages[i].name;
        EXPECT_GT(stages[i].ms, 0.0) << stages[i].name;
    }
    // The stage waits for its kernels. Both clocks are the host's with PoCL; other devices' may run 1 % apart.
    EXPECT_GT(stages[1].ms, 0.99 * stages[1].device_ms);
    EXPECT_TRUE(work.finish().empty());
}

TEST(Work, CompilingIsAStageOfItsOwn)
{
    const TemporaryFolder folder;
    Device device;
    Work work(device.context);
    const std::string unique = "// " + folder.path() + "\n"; // no cache has it
    const auto start = std::chrono::steady_clock::now();
    work.stage("shade");
    const auto depth = work.upload<float>(ramp(64), "depth");
    const auto texels = work.buffer<cl_float2>(64, "texels");
    work.launch({"occluders.cl", {{"UNIQUE", unique}}}, "disparity_from_depth", {64, 1}, {64, 1}, 64 * 12, cl_int2{{64, 1}}, depth, texels);
    const auto stages = work.finish();
    const double wall = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();

    EXPECT_GT(stage_of(stages, "compile").ms, 0.0);
    EXPECT_LT(stage_of(stages, "shade").ms, stage_of(stages, "compile").ms); // 64 divisions against a compiler's run
    EXPECT_LE(stage_of(stages, "shade").ms + stage_of(stages, "compile").ms, wall);
}

// Waits for that, up to a minute.
template <class Holds> bool comes(const Holds& holds)
{
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (!holds() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    return holds();
}

// Whoever asks for the stop can tell a compiler, which nothing stops, from a kernel that looks, at its first launch too.
TEST(Work, IsDeafWhileItCompilesOnly)
{
    const TemporaryFolder folder;
    Device device;
    // No cache has it, and a compiler takes its time.
    std::string text = "__constant char where[] = \"" + folder.path() + "\";\n"; // a comment is not in the driver's key
    for (int i = 0; i < 1000; ++i) text += "float f" + std::to_string(i) + "(float x) { for (int i = 0; i < 9; ++i) x = sin(x) + pow(x, " + std::to_string(i) + ".5f); return x; }\n";
    text += "__kernel void patient(__global const volatile int* stop, __global float* out) { float x = out[0]; while (!*stop) {} ";
    for (int i = 0; i < 20; ++i) text += "x = f" + std::to_string(i) + "(x); ";
    text += "out[0] = x; }";

    Stop stop;
    const StopScope scope(stop);
    Work work(device.context);
    const auto out = work.upload<float>(ramp(1), "out");
    ASSERT_TRUE(work.stop()());
    const auto deaf = [&] { return stop.deaf(); };
    bool building = false, running = false;
    std::jthread first([&] { building = comes(deaf); });
    const cl::Kernel kernel = device.kernel(text, "patient");
    first.join();
    EXPECT_TRUE(building);
    EXPECT_FALSE(stop.deaf());

    std::jthread second([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(300)); // within the launch, as a rule
        running = comes([&] { return !stop.deaf(); });
        stop.ask();
    });
    const auto run = [&] {
        work.launch(kernel, "patient", {1, 1}, {1, 1}, 4, work.stop(), out);
        work.finish();
    };
    EXPECT_THROW(run(), Stopped);
    second.join();
    EXPECT_TRUE(running) << "the kernel is no compiler";
}

TEST(Work, CompilesNothingOnceItIsToStop)
{
    const TemporaryFolder folder;
    Device device;
    Stop stop;
    stop.ask();
    const StopScope scope(stop);
    EXPECT_THROW(device.kernel("__kernel void one() {} // " + folder.path(), "one"), Stopped);
    EXPECT_FALSE(stop.deaf());
    EXPECT_EQ(device.programs.built_from_source(), 0);
}

TEST(Work, OutsideAnyStage)
{
    Device device;
    Work work(device.context);
    work.upload<float>(ramp(8), "data");
    const auto stages = work.finish();
    ASSERT_EQ(stages.size(), 1u);
    EXPECT_EQ(stages[0].name, "work");
    EXPECT_TRUE(Work(device.context).finish().empty());
}

// Kernel objects are not safe to share; each launch has its own.
TEST(Work, FourThreads)
{
    Device device;
    std::array<int, 4> wrong = {};
    std::vector<std::thread> threads;
    for (int thread = 0; thread < 4; ++thread) {
        threads.emplace_back([&device, &wrong, thread] {
            Work work(device.context);
            const auto out = work.buffer<float>(256, "out");
            for (int round = 0; round < 250; ++round) {
                const float offset = static_cast<float>(1000 * thread + round);
                work.launch(device.kernel(kernels, "line"), "line", {256, 1}, {64, 1}, out.bytes(), Line{1.0f, 256}, offset, out);
                const auto values = work.read(out);
                if (values.front() != offset || values.back() != 255.0f + offset) ++wrong[static_cast<std::size_t>(thread)];
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, (std::array<int, 4>{}));
}

// --- The caller's queue -------------------------------------------------------------------------------------------------------

TEST(CallersQueue, NothingWaits)
{
    Device device;
    const cl::CommandQueue queue(device.context->context(), device.context->device());
    const auto kernel = device.kernel(kernels, "copy");
    Work work(device.context, queue());
    work.stage("shade");
    const auto in = work.upload<float>(ramp(93), "in");
    auto out = work.buffer<float>(93, "out");

    // The queue stands still until the event is set; a launch that waited for it would never come back.
    cl::UserEvent gate(device.context->context());
    const std::vector<cl::Event> gates = {gate};
    queue.enqueueBarrierWithWaitList(&gates);
    {
        // The temporary is dropped before its kernels run: the driver holds it.
        const auto between = work.buffer<float>(93, "between");
        work.launch(kernel, "copy", {93, 1}, {64, 1}, 0, cl_int2{{93, 1}}, in, between);
        work.launch(device.kernel(kernels, "copy"), "copy", {93, 1}, {64, 1}, 0, cl_int2{{93, 1}}, between, out);
    }
    // Something else takes its place, if it was really given back.
    std::vector<Buffer<float>> others;
    for (int i = 0; i < 16; ++i) others.push_back(work.buffer<float>(93, "other"));

    const auto stages = work.finish();
    EXPECT_EQ(stage_of(stages, "shade").device_ms, 0.0); // not profiled
    gate.setStatus(CL_COMPLETE);
    EXPECT_EQ(work.read(out), ramp(93));
}

TEST(CallersQueue, ProfiledWhereTheQueueIs)
{
    Device device;
    const cl::CommandQueue queue(device.context->context(), device.context->device(), CL_QUEUE_PROFILING_ENABLE);
    Work work(device.context, queue());
    work.stage("upload");
    work.upload<float>(ramp(4096), "data"); // blocks, so that it is done
    EXPECT_GT(stage_of(work.finish(), "upload").device_ms, 0.0);
}

TEST(CallersQueue, OutOfOrderOrForeignIsRefused)
{
    Device device;
    EXPECT_EQ(error_of([&] { Work(device.context, nullptr); }).code(), ErrorCode::usage);

    const cl::Context other(device.context->device());
    const cl::CommandQueue foreign(other, device.context->device());
    EXPECT_EQ(error_of([&] { Work(device.context, foreign()); }).code(), ErrorCode::usage);

    const auto supported = device.context->device().getInfo<CL_DEVICE_QUEUE_PROPERTIES>();
    if (!(supported & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE)) GTEST_SKIP() << "the device has no such queues";
    const cl::CommandQueue loose(device.context->context(), device.context->device(), CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
    EXPECT_EQ(error_of([&] { Work(device.context, loose()); }).code(), ErrorCode::usage);
}

} // namespace
} // namespace penumbra::opencl::test
