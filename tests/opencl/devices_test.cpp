// Which device is chosen, and what is said when there is none.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include "fixture.hpp"
#include "opencl/cache_folder.hpp"
#include "opencl/errors.hpp"

namespace penumbra::opencl::test {
namespace {

std::string variable(const char* name)
{
    const char* value = std::getenv(name);
    return value ? value : "";
}

TEST(Devices, ListHasEveryFigure)
{
    const auto devices = list_devices();
    ASSERT_FALSE(devices.empty());
    for (std::size_t i = 0; i < devices.size(); ++i) {
        const DeviceInfo& info = devices[i];
        EXPECT_EQ(info.index, static_cast<int>(i));
        EXPECT_FALSE(info.name.empty());
        EXPECT_FALSE(info.driver.empty());
        EXPECT_TRUE(holds(info.version, "OpenCL ")) << info.version;
        EXPECT_TRUE(holds(info.platform, "OpenCL ")) << info.platform;
        EXPECT_GT(info.compute_units, 0u);
        EXPECT_GT(info.global_bytes, 0u);
        EXPECT_GE(info.global_bytes, info.max_allocation_bytes);
        EXPECT_GT(info.max_allocation_bytes, 0u);
        EXPECT_GT(info.local_bytes, 0u);
        EXPECT_GT(info.max_work_group, 0u);
        EXPECT_EQ(info.lanes, info.type == "CPU" ? 16u : 1u);
    }
}

TEST(Devices, SelectedByIndexOrByPartOfName)
{
    const auto devices = list_devices();
    ASSERT_FALSE(devices.empty());
    EXPECT_EQ(Context::open("0")->info().name, devices[0].name);

    std::string part = devices[0].name.substr(1, 5);
    std::transform(part.begin(), part.end(), part.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    EXPECT_TRUE(Context::open(part)->info().index == 0) << part;
    EXPECT_EQ(Context::open("")->info().name, devices[0].name);
}

TEST(Devices, NoMatchListsWhatThereIs)
{
    const auto devices = list_devices();
    ASSERT_FALSE(devices.empty());
    for (const std::string selector : {"no such device", "99", "99999999999999999999999", "-1"}) {
        const Error error = error_of([&] { Context::open(selector); });
        EXPECT_EQ(error.code(), ErrorCode::device);
        EXPECT_TRUE(holds(error.message(), selector)) << error.what();
        EXPECT_TRUE(holds(error.message(), "0: " + devices[0].name)) << error.what();
    }
}

TEST(Devices, DISABLED_EnvironmentSelects)
{
    const Error error = error_of([] { Context::open(""); });
    EXPECT_TRUE(holds(error.message(), "not there")) << error.what();
    EXPECT_EQ(Context::open("0")->info().index, 0); // what is asked for goes first
}

TEST(Devices, EnvironmentSelects) { EXPECT_EQ(run_in_child("Devices.DISABLED_EnvironmentSelects", {{"PENUMBRA_DEVICE", "not there"}}), 0); }

TEST(Devices, DISABLED_NoDriver)
{
    EXPECT_TRUE(list_devices().empty());
    const Error error = error_of([] { Context::open(""); });
    EXPECT_EQ(error.code(), ErrorCode::device);
    EXPECT_EQ(error.message(), "no OpenCL device found");
    EXPECT_TRUE(holds(error.hint(), "pocl-opencl-icd"));
}

TEST(Devices, NoDriver) { EXPECT_EQ(run_in_child("Devices.DISABLED_NoDriver", {{"OCL_ICD_VENDORS", "/nonexistent"}}), 0); }

TEST(Devices, WrappedContextIsRetained)
{
    const Device device;
    cl::Context callers(device.context->device());
    const auto count = [&] { return callers.getInfo<CL_CONTEXT_REFERENCE_COUNT>(); };
    const cl_uint before = count();
    {
        const auto wrapped = Context::wrap(callers(), device.context->device()());
        EXPECT_GT(count(), before);
        EXPECT_EQ(wrapped->context()(), callers());
        EXPECT_EQ(wrapped->info().name, device.context->info().name);
        EXPECT_EQ(wrapped->info().index, 0);
        Work work(wrapped);
        const std::vector<float> data = {1, 2, 3};
        EXPECT_EQ(work.read(work.upload<float>(data, "data")), data);
    }
    // Drivers let go of finished commands, and what these hold, a little later.
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (count() > before && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
    EXPECT_EQ(count(), before);
}

TEST(Devices, WrapRefusesNull)
{
    const Device device;
    EXPECT_EQ(error_of([&] { Context::wrap(nullptr, device.context->device()()); }).code(), ErrorCode::usage);
    EXPECT_EQ(error_of([&] { Context::wrap(device.context->context()(), nullptr); }).code(), ErrorCode::usage);
}

TEST(Environment, DISABLED_Prepared)
{
    list_devices();
    EXPECT_EQ(variable("POCL_SIGFPE_HANDLER"), "0");
    cpu_set_t allowed;
    ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
    EXPECT_EQ(variable("POCL_MAX_PTHREAD_COUNT"), std::to_string(CPU_COUNT(&allowed)));

    const std::string folder = variable("POCL_CACHE_DIR");
    EXPECT_EQ(folder, variable("PENUMBRA_TEST_FOLDER"));
    struct stat status = {};
    ASSERT_EQ(stat(folder.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0700u);

    // And a program runs.
    Device device;
    Work work(device.context);
    const auto out = work.buffer<int>(1, "out");
    work.launch(device.kernel("__kernel void one(__global int* out) { out[0] = 1; }", "one"), "one", {1, 1}, {1, 1}, 4, out);
    EXPECT_EQ(work.read(out), std::vector<int>{1});
}

TEST(Environment, CacheFolderIsPrivate)
{
    const TemporaryFolder folder;
    EXPECT_EQ(run_in_child("Environment.DISABLED_Prepared",
                           {{"PENUMBRA_CACHE_DIR", folder.path() + "/a/b"}, {"PENUMBRA_TEST_FOLDER", folder.path() + "/a/b/kernels"}}),
              0);
}

// PoCL crashes in a cache folder that it cannot write to.
TEST(Environment, UnwritableCacheFolder)
{
    const TemporaryFolder folder;
    const std::string substitute = folder.path() + "/penumbra-kernels-" + std::to_string(geteuid());
    EXPECT_EQ(run_in_child("Environment.DISABLED_Prepared",
                           {{"PENUMBRA_CACHE_DIR", "/dev/null/x"}, {"TMPDIR", folder.path()}, {"PENUMBRA_TEST_FOLDER", substitute}}),
              0);
    EXPECT_EQ(run_in_child("Environment.DISABLED_Prepared", {{"PENUMBRA_CACHE_DIR", ""},
                                                             {"XDG_CACHE_HOME", ""},
                                                             {"HOME", ""},
                                                             {"TMPDIR", folder.path()},
                                                             {"PENUMBRA_TEST_FOLDER", substitute}}),
              0);
}

TEST(Environment, DISABLED_WhatTheUserSetStays)
{
    list_devices();
    EXPECT_EQ(variable("POCL_SIGFPE_HANDLER"), "1");
    EXPECT_EQ(variable("POCL_MAX_PTHREAD_COUNT"), "1");
    EXPECT_EQ(variable("POCL_CACHE_DIR"), variable("PENUMBRA_TEST_FOLDER"));
}

TEST(Environment, WhatTheUserSetStays)
{
    const TemporaryFolder folder;
    EXPECT_EQ(run_in_child("Environment.DISABLED_WhatTheUserSetStays", {{"POCL_SIGFPE_HANDLER", "1"},
                                                                        {"POCL_MAX_PTHREAD_COUNT", "1"},
                                                                        {"POCL_CACHE_DIR", folder.path()},
                                                                        {"PENUMBRA_TEST_FOLDER", folder.path()}}),
              0);
}

TEST(CacheFolder, OthersMustNotWriteThere)
{
    const TemporaryFolder folder;
    const std::string open = folder.path() + "/open", link = folder.path() + "/link";
    ASSERT_TRUE(make_private_folder(open));
    EXPECT_TRUE(make_private_folder(open)); // again
    std::filesystem::create_directory_symlink(open, link);
    EXPECT_FALSE(make_private_folder(link));
    ASSERT_EQ(chmod(open.c_str(), 0770), 0);
    EXPECT_FALSE(make_private_folder(open));
    EXPECT_FALSE(make_private_folder("/dev/null"));
    EXPECT_FALSE(make_private_folder("/proc/penumbra"));
    EXPECT_FALSE(make_private_folder(""));
}

TEST(Errors, NameAndNumbers)
{
    EXPECT_EQ(error_name(CL_OUT_OF_RESOURCES), "CL_OUT_OF_RESOURCES (-5)");
    EXPECT_EQ(error_name(-1001), "CL_PLATFORM_NOT_FOUND_KHR (-1001)");
    EXPECT_EQ(error_name(-9999), "error -9999");
    const Error error = device_error(cl::Error(-54, "clEnqueueNDRangeKernel"), "kernel shade, local 3 x 5");
    EXPECT_EQ(error.message(), "kernel shade, local 3 x 5: clEnqueueNDRangeKernel failed with CL_INVALID_WORK_GROUP_SIZE (-54)");
    EXPECT_EQ(error.code(), ErrorCode::device);
    EXPECT_EQ(bytes_text(1023), "1023 bytes");
    EXPECT_EQ(bytes_text(1073741824), "1073741824 bytes (1.00 GiB)");
}

} // namespace
} // namespace penumbra::opencl::test
