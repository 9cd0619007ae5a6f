// Programs in memory and on disk: never stale, never damaged, built once.
#include <fstream>
#include <iterator>
#include <thread>

#include <sys/stat.h>

#include "fixture.hpp"
#include "opencl/cache_folder.hpp"
#include "opencl/program_text.hpp"

namespace penumbra::opencl::test {
namespace {

namespace fs = std::filesystem;

// A kernel that tells the value of its specialisation constant.
std::string text_of(int value)
{
    return program_text({"value.cl", {{"VALUE", std::to_string(value)}}}, [](std::string_view) {
        return "__kernel void value(__global int* out)\n{\n    out[get_global_id(0)] = VALUE;\n}\n";
    });
}

struct Cached {
    std::shared_ptr<Context> context = Context::open("");
    ProgramCache programs;

    explicit Cached(const std::string& folder) : programs(context->context(), context->device(), folder) {}

    int value(int wanted)
    {
        double compile_ms = 0;
        Work work(context);
        const auto out = work.buffer<int>(1, "out");
        work.launch(cl::Kernel(programs.program("value.cl", text_of(wanted), compile_ms), "value"), "value", {1, 1}, {1, 1}, 4, out);
        return work.read(out).front();
    }
};

std::vector<fs::path> program_files(const std::string& folder)
{
    std::vector<fs::path> paths;
    for (const auto& entry : fs::directory_iterator(folder)) paths.push_back(entry.path());
    return paths;
}

std::string content(const fs::path& path)
{
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
}

void overwrite(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes; }

TEST(ProgramCache, ChangedConstantChangesTheResult)
{
    const TemporaryFolder folder;
    Cached cached(folder.path());
    for (const int value : {1, 2, 1, 3}) EXPECT_EQ(cached.value(value), value);
    EXPECT_EQ(cached.programs.built_from_source(), 3);
    EXPECT_EQ(program_files(folder.path()).size(), 3u);
}

TEST(ProgramCache, DISABLED_ValueInThisProcess)
{
    Cached cached(cache_folder() + "/programs");
    const int value = std::atoi(std::getenv("PENUMBRA_TEST_VALUE"));
    EXPECT_EQ(cached.value(value), value);
    EXPECT_EQ(cached.programs.loaded_from_disk(), std::atoi(std::getenv("PENUMBRA_TEST_LOADED")));
}

TEST(ProgramCache, ChangedConstantChangesTheResultInTheNextProcess)
{
    const TemporaryFolder folder;
    const auto run = [&](const char* value, const char* loaded) {
        return run_in_child("ProgramCache.DISABLED_ValueInThisProcess",
                            {{"PENUMBRA_CACHE_DIR", folder.path()}, {"PENUMBRA_TEST_VALUE", value}, {"PENUMBRA_TEST_LOADED", loaded}});
    };
    EXPECT_EQ(run("1", "0"), 0);
    EXPECT_EQ(run("2", "0"), 0);
    EXPECT_EQ(run("1", "1"), 0);
    EXPECT_EQ(run("2", "1"), 0);
}

TEST(ProgramCache, FilesAreForTheirOwnerOnly)
{
    const TemporaryFolder folder;
    Cached(folder.path()).value(1);
    ASSERT_EQ(program_files(folder.path()).size(), 1u);
    struct stat status = {};
    ASSERT_EQ(stat(program_files(folder.path()).front().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST(ProgramCache, DamagedFilesAreReplaced)
{
    const TemporaryFolder folder;
    Cached(folder.path()).value(1);
    ASSERT_EQ(program_files(folder.path()).size(), 1u);
    const fs::path path = program_files(folder.path()).front();
    const std::string good = content(path);
    ASSERT_GT(good.size(), 100u);

    // Every part of the header and of the payload: magic, format, key, length, checksum, first and last byte; shorter and longer files.
    std::vector<std::string> bad = {"", "x", good.substr(0, 55), good.substr(0, 56), good.substr(0, good.size() - 1), good + '\0'};
    for (const std::size_t at : {std::size_t{0}, std::size_t{8}, std::size_t{16}, std::size_t{31}, std::size_t{32}, std::size_t{39},
                                 std::size_t{40}, std::size_t{55}, std::size_t{56}, good.size() - 1}) {
        bad.push_back(good);
        bad.back()[at] = static_cast<char>(bad.back()[at] ^ 1);
    }
    for (std::size_t i = 0; i < bad.size(); ++i) {
        overwrite(path, bad[i]);
        Cached cached(folder.path());
        EXPECT_EQ(cached.value(1), 1) << "case " << i;
        EXPECT_EQ(cached.programs.built_from_source(), 1) << "case " << i;
        EXPECT_EQ(content(path).substr(0, 32), good.substr(0, 32)) << "not rewritten in case " << i;
    }
    Cached again(folder.path());
    EXPECT_EQ(again.value(1), 1);
    EXPECT_EQ(again.programs.loaded_from_disk(), 1);
}

// A whole and sound file, but of another program: its key does not fit the name.
TEST(ProgramCache, ForeignFileIsIgnored)
{
    const TemporaryFolder folder;
    Cached(folder.path()).value(1);
    const fs::path first = program_files(folder.path()).front();
    const std::string of_first = content(first);
    Cached(folder.path()).value(2);
    for (const fs::path& path : program_files(folder.path())) overwrite(path, of_first);

    Cached cached(folder.path());
    EXPECT_EQ(cached.value(2), 2);
    EXPECT_EQ(cached.programs.built_from_source(), 1);
}

// Sound, the right key, but nothing that the driver takes: the source is built.
TEST(ProgramCache, RefusedBinaryFallsBackToSource)
{
    const TemporaryFolder folder;
    Cached(folder.path()).value(1);
    const std::string name = program_files(folder.path()).front().stem().string();
    const ProgramKey key = {std::stoull(name.substr(0, 16), nullptr, 16), std::stoull(name.substr(16), nullptr, 16)};
    ASSERT_EQ(hexadecimal(key), name);
    ASSERT_TRUE(write_program_file(folder.path(), key, std::vector<unsigned char>(1000, 0x5a)));

    Cached cached(folder.path());
    EXPECT_EQ(cached.value(1), 1);
    EXPECT_EQ(cached.programs.built_from_source(), 1);
}

TEST(ProgramCache, WithoutAFolderInMemoryOnly)
{
    for (const std::string folder : {"", "/dev/null/x", "/proc/penumbra"}) {
        Cached cached(folder);
        EXPECT_EQ(cached.value(1), 1);
        EXPECT_EQ(cached.value(1), 1);
        EXPECT_EQ(cached.programs.built_from_source(), 1);
    }
}

// The folder goes away while the program runs.
TEST(ProgramCache, FolderRemovedMeanwhile)
{
    const TemporaryFolder folder;
    Cached cached(folder.path());
    fs::remove_all(folder.path());
    EXPECT_EQ(cached.value(1), 1);
}

TEST(ProgramCache, ThreadsBuildOnce)
{
    Cached cached("");
    std::vector<std::thread> threads;
    std::vector<double> compile_ms(4, 0.0);
    for (double& ms : compile_ms) {
        threads.emplace_back([&] { cached.programs.program("value.cl", text_of(17), ms); });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(cached.programs.built_from_source(), 1);
    EXPECT_GT(*std::max_element(compile_ms.begin(), compile_ms.end()), 0.0);

    double again = 0;
    cached.programs.program("value.cl", text_of(17), again);
    EXPECT_EQ(again, 0.0);
}

TEST(ProgramCache, BuildFailureShowsTheLogsFirstError)
{
    Cached cached("");
    double compile_ms = 0;
    const std::string text =
        program_text({"broken.cl", {}}, [](std::string_view) { return "__kernel void broken()\n{\n    undeclared = 1;\n}\n"; });
    for (int attempt = 0; attempt < 2; ++attempt) {
        const Error error = error_of([&] { cached.programs.program("broken.cl", text, compile_ms); });
        EXPECT_EQ(error.code(), ErrorCode::device);
        EXPECT_TRUE(holds(error.message(), "CL_BUILD_PROGRAM_FAILURE (-11)")) << error.what();
        EXPECT_TRUE(holds(error.message(), "broken.cl:3")) << error.what();
        EXPECT_TRUE(holds(error.message(), "undeclared")) << error.what();
        EXPECT_FALSE(holds(error.message(), "\n")) << error.what();
    }
}

// PoCL's own header takes longer to read than our declarations of what the kernels call; a program that calls more reads it all the same.
TEST(ProgramCache, DriversHeaderIsReadWhereItIsNeededAlone)
{
    Cached cached("");
    if (quirks_of(cached.context->device()).builtins.empty()) GTEST_SKIP() << "a driver whose header is taken";
    double compile_ms = 0;
    cached.programs.program("value.cl", text_of(1), compile_ms);
    EXPECT_EQ(cached.programs.built_with_header(), 0);
    cached.programs.program("sine.cl", "__kernel void sine(__global float* a)\n{\n    a[0] = sin(a[0]);\n}\n", compile_ms);
    EXPECT_EQ(cached.programs.built_with_header(), 1);
}

TEST(ProgramKey, DependsOnEveryPart)
{
    EXPECT_EQ(program_key({"a", "b"}), program_key({"a", "b"}));
    EXPECT_NE(program_key({"ab", ""}), program_key({"a", "b"}));
    EXPECT_NE(program_key({"a", "b"}), program_key({"b", "a"}));
    EXPECT_NE(program_key({"a"}), program_key({"a", ""}));
    EXPECT_EQ(hexadecimal({0, 255}), "000000000000000000000000000000ff");
}

} // namespace
} // namespace penumbra::opencl::test
