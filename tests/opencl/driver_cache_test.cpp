// The folder of PoCL's kernels: whatever happened to it, the next process computes.
#include <fstream>
#include <functional>
#include <iterator>
#include <map>

#include <sys/mount.h>
#include <sys/stat.h>

#include "fixture.hpp"
#include "opencl/driver_cache.hpp"

namespace penumbra::opencl::test {
namespace {

namespace fs = std::filesystem;

const std::string hash_a = "AB/CDEFGHIJKLMNOPABCDEFGHIJKLMNOPABCDEFG", hash_b = "PO/NMLKJIHGFEDCBAPONMLKJIHGFEDCBAPONMLKJ";

std::string content(const fs::path& path)
{
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
}

void put(const fs::path& path, const std::string& bytes)
{
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

// A folder with two programs as PoCL leaves them. The library is one that can be read up to its last section: this executable will do.
class DriverCacheFolder : public ::testing::Test {
protected:
    DriverCacheFolder()
    {
        put_program(hash_a);
        put_program(hash_b);
    }
    std::string path(const std::string& name) const { return folder_.path() + '/' + name; }
    static std::string bitcode(const std::string& hash) { return hash + "/program.bc"; }
    static std::string library(const std::string& hash) { return hash + "/shade/16-8-1-goffs0-smallgrid/shade.so"; }
    void put_program(const std::string& hash) const
    {
        put(path(bitcode(hash)), "BC\xC0\xDE" + hash.substr(0, 8));
        put(path(hash + "/last_accessed"), "");
        fs::create_directories(fs::path(path(library(hash))).parent_path());
        fs::copy_file("/bin/true", path(library(hash)));
    }
    bool has(const std::string& hash) const { return fs::exists(path(hash)); }
    // The folder with both programs in the list, as a process leaves it.
    void recorded() const
    {
        DriverCache cache(folder_.path(), true);
        put_program(hash_a);
        put_program(hash_b);
        cache.record();
    }
    TemporaryFolder folder_;
};

TEST_F(DriverCacheFolder, WhatIsNotInTheListWasLeftByAProcessThatDied)
{
    put(path("tempfile_x.cl"), "half");
    EXPECT_EQ(DriverCache(folder_.path(), true).thrown_away(), 2);
    EXPECT_FALSE(has(hash_a) || has(hash_b) || has("tempfile_x.cl"));
}

TEST_F(DriverCacheFolder, WhatIsRecordedStays)
{
    recorded();
    for (int again = 0; again < 3; ++again) EXPECT_EQ(DriverCache(folder_.path(), true).thrown_away(), 0);
    EXPECT_TRUE(has(library(hash_a)) && has(library(hash_b)));
}

// The list's last words are about another start of the machine, or the folder was copied: the same bytes are the same program.
TEST_F(DriverCacheFolder, OtherTimesOrAnotherBootAreReadAgain)
{
    recorded();
    const std::string list = content(path(".penumbra-kernels"));
    put(path(".penumbra-kernels"), list + "boot of long ago\n");
    EXPECT_EQ(DriverCache(folder_.path(), true).thrown_away(), 0);
    const TemporaryFolder other;
    fs::copy(folder_.path(), other.path(), fs::copy_options::recursive);
    EXPECT_EQ(DriverCache(other.path(), true).thrown_away(), 0);
    EXPECT_EQ(DriverCache(other.path(), true).thrown_away(), 0);
}

// Every kind of damage to every kind of file: that program goes, the other stays.
TEST_F(DriverCacheFolder, DamageIsThrownAwayAProgramAtATime)
{
    const std::vector<std::pair<const char*, std::function<void(const fs::path&)>>> damages = {
        {"emptied", [](const fs::path& file) { put(file, ""); }},
        {"zeroed", [](const fs::path& file) { put(file, std::string(fs::file_size(file), '\0')); }},
        {"shortened", [](const fs::path& file) { fs::resize_file(file, fs::file_size(file) / 2); }},
        {"longer", [](const fs::path& file) { put(file, content(file) + "x"); }},
        {"last byte",
         [](const fs::path& file) {
             put(file, [&] {
                 std::string bytes = content(file);
                 bytes.back() ^= 1;
                 return bytes;
             }());
         }},
        {"foreign", [](const fs::path& file) { put(file, std::string(20000, 'g')); }},
        {"gone", [](const fs::path& file) { fs::remove(file); }},
        {"a folder",
         [](const fs::path& file) {
             fs::remove(file);
             put(file / "x", "x");
         }},
        {"an empty folder",
         [](const fs::path& file) {
             fs::remove(file);
             fs::create_directory(file);
         }},
        {"a link",
         [](const fs::path& file) {
             fs::remove(file);
             fs::create_symlink("/dev/zero", file);
         }},
    };
    for (const auto& [name, damage] : damages) {
        for (const std::string& file : {bitcode(hash_a), library(hash_a)}) {
            fs::remove_all(path(hash_a));
            fs::remove_all(path(hash_b));
            recorded();
            damage(path(file));
            DriverCache cache(folder_.path(), true);
            EXPECT_EQ(cache.thrown_away(), 1) << name << ' ' << file;
            EXPECT_FALSE(has(hash_a)) << name << ' ' << file;
            EXPECT_TRUE(has(library(hash_b))) << name << ' ' << file;
        }
    }
}

TEST_F(DriverCacheFolder, FilesInTheFoldersPlaces)
{
    for (const std::string& place : {hash_a, hash_a.substr(0, 2), hash_a + "/last_accessed/x"}) {
        fs::remove_all(path(hash_a.substr(0, 2)));
        fs::remove_all(path(hash_b));
        recorded();
        if (place.ends_with('x'))
            fs::remove(path(hash_a + "/last_accessed"));
        else
            fs::remove_all(path(place));
        put(path(place), "x");
        DriverCache cache(folder_.path(), true);
        EXPECT_FALSE(has(hash_a)) << place;
        EXPECT_TRUE(has(library(hash_b))) << place;
        put_program(hash_a);
    }
}

TEST_F(DriverCacheFolder, ADamagedListKnowsNothing)
{
    for (const std::string& list :
         {std::string(), std::string(500, '\0'), std::string("boot\n- \n1 2 3\nzz zz zz zz AB/x\n1 2 3 4 AB/../x\n\xff\xfe")}) {
        recorded();
        put(path(".penumbra-kernels"), list);
        DriverCache(folder_.path(), true);
        EXPECT_FALSE(has(hash_a) || has(hash_b));
    }
    recorded();
    for (const std::string& name : {std::string(".penumbra-kernels"), bitcode(hash_a), hash_b + "/last_accessed"}) {
        fs::remove_all(path(name));
        fs::create_directory(path(name));
    }
    DriverCache(folder_.path(), true);
    EXPECT_FALSE(has(hash_a) || has(hash_b));
    recorded();
    for (const char* name : {".penumbra-kernels", ".penumbra-lock"}) {
        fs::remove_all(path(name));
        put(path(name) + "/x", "x");
    }
    DriverCache(folder_.path(), true);
    EXPECT_FALSE(has(hash_a) || has(hash_b));
    recorded();
    EXPECT_EQ(DriverCache(folder_.path(), true).thrown_away(), 0);
}

// What others write now is not in the list yet. It stays if it looks whole.
TEST_F(DriverCacheFolder, OthersAtWork)
{
    const DriverCache other(folder_.path(), true);
    put_program(hash_a);
    put_program(hash_b);
    fs::resize_file(path(library(hash_b)), 5000);
    DriverCache cache(folder_.path(), true);
    EXPECT_TRUE(has(library(hash_a)));
    EXPECT_FALSE(has(hash_b));
}

// A folder that the user shares with other programs: what they keep there is theirs.
TEST_F(DriverCacheFolder, OfTheUser)
{
    put(path("tempfile_x.cl"), "theirs");
    {
        DriverCache cache(folder_.path(), false);
        EXPECT_EQ(cache.thrown_away(), 0);
        cache.record();
    }
    put(path(bitcode(hash_b)), std::string(fs::file_size(path(bitcode(hash_b))), '\0'));
    EXPECT_EQ(DriverCache(folder_.path(), false).thrown_away(), 1);
    EXPECT_TRUE(has(library(hash_a)) && has("tempfile_x.cl"));
}

// Somebody's folder that happens to be called pocl.
TEST_F(DriverCacheFolder, WhatHasNoNameOfPoclsStays)
{
    const std::vector<std::string> names = {"README", "src/main.c", "ab/x", "QZ/x", "ABC/x"};
    for (const std::string& name : names) put(path(name), "x");
    DriverCache(folder_.path(), true);
    for (const std::string& name : names) EXPECT_TRUE(has(name)) << name;
}

// Computes in this process; called in children.
int compute()
{
    Device device;
    Work work(device.context);
    const auto out = work.buffer<int>(1, "out");
    work.launch(device.kernel("__kernel void seven(__global int* out) { out[0] = 7; }", "seven"), "seven", {1, 1}, {1, 1}, 4, out);
    return work.read(out).front();
}

TEST(DriverCacheChild, DISABLED_Computes)
{
    EXPECT_EQ(compute(), 7);
    EXPECT_EQ(environment_warnings().size(), static_cast<std::size_t>(std::atoi(std::getenv("PENUMBRA_TEST_WARNINGS"))));
}

TEST(DriverCacheChild, DISABLED_Says)
{
    const Error error = error_of([] { compute(); });
    EXPECT_EQ(error.code(), ErrorCode::device);
    EXPECT_TRUE(holds(error.what(), std::getenv("PENUMBRA_TEST_PART"))) << error.what();
}

class DriverCacheFaults : public ::testing::Test {
protected:
    using Variables = std::vector<std::pair<std::string, std::string>>;
    int computes(int warnings, Variables more = {})
    {
        return child("DISABLED_Computes", {"PENUMBRA_TEST_WARNINGS", std::to_string(warnings)}, std::move(more));
    }
    int says(const std::string& part, Variables more = {}) { return child("DISABLED_Says", {"PENUMBRA_TEST_PART", part}, std::move(more)); }
    std::string path(const std::string& name) const { return folder_.path() + '/' + name; }
    std::vector<fs::path> cached() const
    {
        std::vector<fs::path> paths;
        for (const auto& entry : fs::recursive_directory_iterator(path("cache")))
            if (entry.is_regular_file()) paths.push_back(entry.path());
        return paths;
    }

private:
    int child(const std::string& test, std::pair<std::string, std::string> what, Variables more)
    {
        fs::create_directory(path("temporary"));
        more.insert(more.begin(), {{"PENUMBRA_CACHE_DIR", path("cache")}, {"TMPDIR", path("temporary")}, std::move(what)});
        return run_in_child("DriverCacheChild." + test, more);
    }
    TemporaryFolder folder_;
};

TEST_F(DriverCacheFaults, DamagedFiles)
{
    ASSERT_EQ(computes(0), 0);
    const std::vector<std::function<void(const fs::path&)>> faults = {
        [](const fs::path& file) { put(file, ""); },
        [](const fs::path& file) { put(file, std::string(fs::file_size(file), '\0')); },
        [](const fs::path& file) {
            if (file.extension() == ".so") fs::resize_file(file, 5000);
        },
        [](const fs::path& file) { put(file, std::string(20000, 'g')); },
    };
    for (std::size_t i = 0; i < faults.size(); ++i) {
        for (const fs::path& file : cached()) faults[i](file);
        EXPECT_EQ(computes(0), 0) << "fault " << i;
        EXPECT_EQ(computes(0), 0) << "after fault " << i;
    }
}

// What PoCL wrote in one process is there in the next, and is not built again.
TEST_F(DriverCacheFaults, SoundKernelsAreKept)
{
    ASSERT_EQ(computes(0), 0);
    std::map<fs::path, fs::file_time_type> before;
    for (const fs::path& file : cached())
        if (file.extension() == ".so" || file.extension() == ".bc") before[file] = fs::last_write_time(file);
    EXPECT_EQ(before.size(), 2u);
    ASSERT_EQ(computes(0), 0);
    for (const auto& [file, time] : before) EXPECT_TRUE(fs::exists(file) && fs::last_write_time(file) == time) << file;
}

TEST_F(DriverCacheFaults, FoldersThatCannotBeUsed)
{
    put(path("cache"), "a file");
    EXPECT_EQ(computes(1), 0);
    fs::remove(path("cache"));
    put(path("cache/kernels"), "a file");
    EXPECT_EQ(computes(1), 0);
    fs::remove_all(path("cache"));
    EXPECT_EQ(computes(1, {{"POCL_CACHE_DIR", "/proc/x"}}), 0);
    EXPECT_EQ(says("/dev/null/x", {{"PENUMBRA_CACHE_DIR", "/dev/null/x"}, {"TMPDIR", "/dev/null/y"}}), 0);
}

TEST_F(DriverCacheFaults, NoLinker)
{
    const std::pair<std::string, std::string> no_path = {"PATH", "/nonexistent"};
    EXPECT_EQ(says("the linker ld is not on PATH (/nonexistent)", {no_path}), 0);
    EXPECT_EQ(computes(0), 0);
    EXPECT_EQ(computes(0, {no_path}), 0); // nothing is to be linked
}

// A disk of its own, where this user may mount one.
TEST_F(DriverCacheFaults, FullDisk)
{
    fs::create_directory(path("cache"));
    ASSERT_EQ(chmod(path("cache").c_str(), 0700), 0);
    if (mount("none", path("cache").c_str(), "tmpfs", 0, "size=300k,mode=700") != 0) GTEST_SKIP() << "no file system can be mounted here";
    EXPECT_EQ(computes(1), 0);
    EXPECT_EQ(says("307200 bytes", {{"TMPDIR", path("cache")}}), 0);
    EXPECT_EQ(mount("none", path("cache").c_str(), nullptr, MS_REMOUNT | MS_RDONLY, nullptr), 0);
    EXPECT_EQ(computes(1), 0);
    EXPECT_EQ(umount(path("cache").c_str()), 0);
}

} // namespace
} // namespace penumbra::opencl::test
