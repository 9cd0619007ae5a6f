// The folder of compiled kernels, damaged or unusable; and work that needs no device at all.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>

#include <nlohmann/json.hpp>

#include <penumbra/image.hpp>

#include "command.hpp"

namespace penumbra::test {
namespace {

namespace fs = std::filesystem;

class KernelCache : public CommandTest {
protected:
    KernelCache() : CommandTest("tmp") {}
    // Computes the mask `name` with the cache in cache/.
    Ran mask(const std::string& name, Environment more = {}) const
    {
        Environment environment{{"PENUMBRA_CACHE_DIR", path("cache")}, {"TMPDIR", path("tmp")}};
        environment.insert(environment.end(), more.begin(), more.end());
        return penumbra({"mask", scene_, "-o", path(name)}, environment);
    }
    void for_each_cached(const std::function<void(const fs::path&)>& fault) const
    {
        std::vector<fs::path> files;
        for (const auto& entry : fs::recursive_directory_iterator(path("cache")))
            if (entry.is_regular_file()) files.push_back(entry.path());
        EXPECT_GT(files.size(), 5u);
        for (const fs::path& file : files) fault(file);
    }
    // The mask is right, and nothing is said but these warnings.
    void expect_right(const Ran& ran, const std::string& name, const std::vector<std::string>& warning = {}) const
    {
        EXPECT_EQ(ran.code, 0) << ran.err;
        expect_same_bytes(path(name), path("good.exr"));
        if (warning.empty()) {
            EXPECT_EQ(ran.err, "");
            return;
        }
        EXPECT_EQ(ran.err.rfind("penumbra: warning: ", 0), 0u) << ran.err;
        EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
        for (const std::string& part : warning) EXPECT_NE(ran.err.find(part), std::string::npos) << ran.err;
    }
    const std::string scene_ = write_scene("scene.json");
};

TEST_F(KernelCache, HealsWhateverHappenedToItsFiles)
{
    const Ran cold = mask("good.exr");
    ASSERT_EQ(cold.code, 0) << cold.err;
    EXPECT_EQ(cold.err, ""); // drivers count their compiler's warnings there
    const std::vector<std::function<void(const fs::path&)>> faults = {
        [](const fs::path& file) { fs::resize_file(file, 0); },
        [](const fs::path& file) {
            const auto size = fs::file_size(file);
            fs::resize_file(file, 0);
            fs::resize_file(file, size);
        },
        [](const fs::path& file) {
            if (file.extension() == ".so") fs::resize_file(file, 5000);
        },
        [](const fs::path& file) { std::ofstream(file) << std::string(20000, 'g'); },
        [](const fs::path& file) {
            fs::remove(file);
            fs::create_directory(file);
        },
    };
    for (std::size_t i = 0; i < faults.size(); ++i) {
        SCOPED_TRACE("fault " + std::to_string(i));
        for_each_cached(faults[i]);
        expect_right(mask("mask.exr"), "mask.exr");
    }
}

TEST_F(KernelCache, AFolderThatCannotBeUsedIsNamedOnce)
{
    ASSERT_EQ(mask("good.exr").code, 0);
    expect_right(mask("a.exr", {{"POCL_CACHE_DIR", "/proc/x"}}), "a.exr", {"/proc/x (POCL_CACHE_DIR)", path("tmp")});
    fs::remove_all(path("cache"));
    write_text(path("cache"), "a file");
    expect_right(mask("b.exr"), "b.exr", {path("cache") + " is not a folder", path("tmp")});
    expect_one_error(mask("c.exr", {{"TMPDIR", "/dev/null/x"}}), 1, {path("cache"), "/dev/null/x", "PENUMBRA_CACHE_DIR"});
}

TEST_F(KernelCache, WithoutALinkerOneLineSaysSo)
{
    expect_one_error(mask("a.exr", {{"PATH", "/nonexistent"}}), 1, {"linker ld", "PATH (/nonexistent)", "binutils"});
    ASSERT_EQ(mask("good.exr").code, 0);
    expect_right(mask("b.exr", {{"PATH", "/nonexistent"}}), "b.exr"); // nothing is to be linked
}

class WithoutADevice : public CommandTest {};

TEST_F(WithoutADevice, RaysAreTraced)
{
    const std::string scene = write_scene("scene.json", R"({"kind": "ray_traced", "samples": 16})");
    const Ran with = penumbra({"mask", scene, "-o", path("with.exr")}),
              without = penumbra({"mask", scene, "-o", path("without.exr")}, no_device);
    EXPECT_EQ(with.code, 0) << with.err;
    EXPECT_EQ(without.code, 0) << without.err;
    EXPECT_EQ(without.err, "");
    expect_same_bytes(path("with.exr"), path("without.exr"));

    // A device that was asked for must be there.
    expect_one_error(penumbra({"mask", scene, "-o", path("m.exr"), "--device", "0"}, no_device), 1, {"no OpenCL device found"});
}

TEST_F(WithoutADevice, ABatchOfRaysIsTraced)
{
    fs::create_directory(path("scenes"));
    write_scene("scenes/a.json", R"({"kind": "ray_traced", "samples": 4})");
    write_scene("scenes/b.json", R"({"kind": "ray_traced", "samples": 4})");
    const Ran ran = penumbra({"batch", path("scenes"), "--out", path("masks")}, no_device);
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_TRUE(fs::exists(path("masks/a.exr")) && fs::exists(path("masks/b.exr")));
    write_scene("scenes/c.json");
    expect_one_error(penumbra({"batch", path("scenes"), "--out", path("more")}, no_device), 1, {"no OpenCL device found"});
}

TEST_F(WithoutADevice, DepthOfMeshesIsRenderedAndMasksAreCompared)
{
    const std::string scene = write_scene("scene.json");
    const Ran depth = penumbra({"depth", scene, "--out", path("depth")}, no_device);
    EXPECT_EQ(depth.code, 0) << depth.err;
    const Ran compared = penumbra({"compare", path("depth/front.exr"), path("depth/front.exr")}, no_device);
    EXPECT_EQ(compared.code, compared.err.empty() ? 0 : 2) << compared.err; // infinities may be refused, a device is not asked for
}

// Somebody else's depth is fitted on a device.
TEST_F(WithoutADevice, DepthImagesThatAreFittedSaySo)
{
    const std::string scene = write_scene("scene.json");
    ASSERT_EQ(penumbra({"depth", scene, "--out", path("depth")}).code, 0);
    expect_one_error(penumbra({"mask", path("depth/scene.json"), "-o", path("m.exr"), "--technique", "depth_trace"}, no_device), 1,
                     {"no OpenCL device found"});
    auto json = nlohmann::json::parse(text_of(path("depth/scene.json")));
    json["objects"] = nlohmann::json::parse(
        R"([{"quad": {"center": [0, 1, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -1]}, "casts": true, "receives": false}])");
    json["technique"] = {{"kind", "ray_traced"}, {"samples", 4}};
    write_text(path("depth/rays.json"), json.dump());
    expect_one_error(penumbra({"mask", path("depth/rays.json"), "-o", path("m.exr")}, no_device), 1, {"no OpenCL device found"});
}

} // namespace
} // namespace penumbra::test
