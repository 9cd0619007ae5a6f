// --isolate: the same work in a process of its own, and its death is one line.
#include <csignal>
#include <fstream>
#include <thread>

#include "command.hpp"

namespace penumbra::test {
namespace {

class Isolate : public CommandTest {};

TEST_F(Isolate, IsTheSameMask)
{
    const std::string scene = write_scene("scene.json", R"({"kind": "ray_traced", "samples": 16})");
    ASSERT_EQ(penumbra({"mask", scene, "-o", path("plain.exr")}).code, 0);
    const Ran ran = penumbra({"mask", scene, "--isolate", "-o", path("isolated.exr")});
    EXPECT_EQ(ran.code, 0) << ran.err;
    expect_same_bytes(path("plain.exr"), path("isolated.exr"));
}

TEST_F(Isolate, PassesErrorsAndCodesOn)
{
    expect_one_error(penumbra({"mask", path("none.json"), "--isolate", "-o", path("mask.exr")}), 2, {"none.json"});
}

// The only child of a process; 0: none yet.
int child_of(int process)
{
    std::ifstream file("/proc/" + std::to_string(process) + "/task/" + std::to_string(process) + "/children");
    int child = 0;
    file >> child;
    return child;
}

TEST_F(Isolate, SaysWhatTheProcessDiedOf)
{
    // Minutes of rays, so that it is at work when it is killed.
    const std::string scene = write_scene("scene.json", R"({"kind": "ray_traced", "samples": 65536})");
    const int process = start({"mask", scene, "--isolate", "-o", path("mask.exr")});
    int child = 0;
    while ((child = child_of(process)) == 0) std::this_thread::yield();
    kill(child, SIGSEGV);
    EXPECT_EQ(wait_for(process), 1);
    EXPECT_EQ(files(), std::vector<std::string>{"scene.json"});
}

} // namespace
} // namespace penumbra::test
