// Copies of built kernels: what was used, with its list, and nothing else.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "process/kernel_copies.hpp"

namespace penumbra::test {
namespace {

namespace fs = std::filesystem;

class KernelCopies : public testing::Test {
protected:
    void SetUp() override
    {
        std::string pattern = (fs::temp_directory_path() / "penumbra-copies-XXXXXX").string();
        folder = mkdtemp(pattern.data());
    }
    void TearDown() override { fs::remove_all(folder); }
    void write(const fs::path& path, const std::string& text) const
    {
        fs::create_directories((folder / path).parent_path());
        std::ofstream(folder / path) << text;
    }
    std::string text_of(const fs::path& path) const
    {
        std::ifstream file(folder / path);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    fs::path folder;
};

TEST_F(KernelCopies, AreOfWhatWasUsedSince)
{
    const std::string used = "AB/CDEF", old = "AB/GHIJ";
    for (const std::string& program : {used, old}) {
        write("shared/kernels/" + program + "/program.bc", program);
        write("shared/kernels/" + program + "/kernel/8-8-1/kernel.so", "code of " + program);
        write("shared/kernels/" + program + "/last_accessed", "");
    }
    write("shared/kernels/.penumbra-kernels", "boot 7\n1f 7 1 1 " + used + "/program.bc\n2f 7 1 1 " + old + "/program.bc\n- XY/ZZ\nnonsense\n");
    write("shared/kernels/tempfile_a.cl", "half of something");
    write("shared/programs/1234.program", "a program");
    fs::create_symlink("/etc/passwd", folder / "shared" / "programs" / "link.program");
    const auto now = fs::file_time_type::clock::now();
    fs::last_write_time(folder / "shared" / "kernels" / old / "last_accessed", now - std::chrono::hours(1));
    fs::create_directory(folder / "worker");

    server::copy_kernels(server::folders_in(folder / "shared"), now - std::chrono::minutes(1), server::folders_in(folder / "worker" / "cache"));

    const std::string kernels = "worker/cache/kernels/";
    EXPECT_EQ(text_of(kernels + used + "/kernel/8-8-1/kernel.so"), "code of " + used);
    EXPECT_EQ(text_of(kernels + used + "/program.bc"), used);
    EXPECT_EQ(text_of(kernels + ".penumbra-kernels"), "1f 7 1 1 " + used + "/program.bc\n");
    EXPECT_FALSE(fs::exists(folder / kernels / old));
    EXPECT_FALSE(fs::exists(folder / kernels / "tempfile_a.cl"));
    EXPECT_EQ(text_of("worker/cache/programs/1234.program"), "a program");
    EXPECT_FALSE(fs::exists(fs::symlink_status(folder / "worker" / "cache" / "programs" / "link.program")));
    // Copies, not other names of the same files: a worker may write to its own.
    EXPECT_EQ(fs::hard_link_count(folder / kernels / used / "program.bc"), 1U);
    EXPECT_EQ(fs::status(folder / "worker" / "cache").permissions(), fs::perms::owner_all);
}

TEST_F(KernelCopies, OfNothingAreNothing)
{
    fs::create_directory(folder / "worker");
    server::copy_kernels({folder / "none", {}}, {}, server::folders_in(folder / "worker" / "cache"));
    EXPECT_TRUE(fs::is_empty(folder / "worker" / "cache" / "kernels"));
    EXPECT_THROW(server::copy_kernels({folder / "none", {}}, {}, server::folders_in(folder / "nobody" / "cache")), fs::filesystem_error);
}

} // namespace
} // namespace penumbra::test
