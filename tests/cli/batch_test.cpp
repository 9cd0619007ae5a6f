// penumbra batch, with a device.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <sstream>
#include <thread>

#include <nlohmann/json.hpp>

#include <penumbra/image.hpp>

#include "command.hpp"

namespace penumbra::test {
namespace {

namespace fs = std::filesystem;

class BatchCommand : public CommandTest {
protected:
    BatchCommand() : CommandTest("scenes") {}

    void write_scenes(int count) const
    {
        for (int i = 0; i < count; ++i)
            write_scene("scenes/s" + std::to_string(i) + ".json", R"({"kind": "soft_shadow_map"})", "", 1 + 3.0 * i / count);
    }

    // Status by the scene's file name.
    std::map<std::string, std::string> statuses(const std::string& manifest) const
    {
        std::map<std::string, std::string> found;
        std::istringstream lines(text_of(path(manifest)));
        for (std::string line; std::getline(lines, line);) {
            const auto json = nlohmann::json::parse(line);
            found[fs::path(json.at("scene").get<std::string>()).filename()] = json.at("status");
            EXPECT_EQ(json.at("error").get<std::string>().empty(), json.at("status") != "failed") << line;
        }
        return found;
    }

    void touch(const std::string& name, std::chrono::seconds from_now) const
    {
        fs::last_write_time(path(name), fs::file_time_type::clock::now() + from_now);
    }
};

using Statuses = std::map<std::string, std::string>;

TEST_F(BatchCommand, FolderGivesTheMasksThatSingleRunsGive)
{
    write_scenes(3);
    write_text(path("scenes/notes.txt"), "no scene");
    const Ran ran = penumbra({"batch", path("scenes"), "--out", path("masks"), "--format", "pfm"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ran.out, "");
    EXPECT_EQ(ran.err, "");
    EXPECT_EQ(files("masks"), (std::vector<std::string>{"manifest.jsonl", "s0.pfm", "s1.pfm", "s2.pfm"}));
    EXPECT_EQ(statuses("masks/manifest.jsonl"), (Statuses{{"s0.json", "done"}, {"s1.json", "done"}, {"s2.json", "done"}}));
    for (const std::string name : {"s0", "s1", "s2"}) {
        EXPECT_EQ(penumbra({"mask", path("scenes/" + name + ".json"), "-o", path("one.pfm")}).code, 0);
        expect_same_bytes(path("one.pfm"), path("masks/" + name + ".pfm"));
    }
    EXPECT_TRUE(text_of(path("masks/s0.pfm")) != text_of(path("masks/s2.pfm")));
}

TEST_F(BatchCommand, ListWithCommentsRelativeToTheList)
{
    write_scenes(3);
    write_text(path("list.txt"), "\xef\xbb\xbf# two of three\n\n  scenes/s2.json \r\n" + path("scenes/s0.json"));
    const Ran ran =
        penumbra({"batch", path("list.txt"), "--out", path("masks"), "--technique", "shadow_map", "--set", "filter=hard", "--verbose"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(files("masks"), (std::vector<std::string>{"manifest.jsonl", "s0.exr", "s2.exr"}));
    EXPECT_NE(ran.err.find("done 1/2 "), std::string::npos) << ran.err;
    EXPECT_NE(ran.err.find("done 2/2 "), std::string::npos) << ran.err;
}

TEST_F(BatchCommand, OutputFormatOfTheScene)
{
    write_scene("scenes/a.json", R"({"kind": "soft_shadow_map"})", R"(, "output": {"format": "png", "bits": 8})");
    write_scene("scenes/b.json");
    EXPECT_EQ(penumbra({"batch", path("scenes"), "--out", path("masks")}).code, 0);
    EXPECT_EQ(files("masks"), (std::vector<std::string>{"a.png", "b.exr", "manifest.jsonl"}));
    EXPECT_EQ(text_of(path("masks/a.png")).at(24), 8);
}

TEST_F(BatchCommand, ABadSceneDoesNotStopTheOthers)
{
    write_scenes(3);
    write_text(path("scenes/s1.json"), R"({"penumbra": 1, "lihgt": {}})");
    const Ran ran = penumbra({"batch", path("scenes"), "--out", path("masks")});
    EXPECT_EQ(ran.code, 2) << ran.err; // wrong input is all that went wrong
    EXPECT_NE(ran.err.find("s1.json: "), std::string::npos) << ran.err;
    EXPECT_NE(ran.err.find("1 of 3 scenes failed"), std::string::npos) << ran.err;
    EXPECT_EQ(files("masks"), (std::vector<std::string>{"manifest.jsonl", "s0.exr", "s2.exr"}));
    EXPECT_EQ(statuses("masks/manifest.jsonl"), (Statuses{{"s0.json", "done"}, {"s1.json", "failed"}, {"s2.json", "done"}}));

    // A mask that cannot be put in place is failed work.
    fs::create_directory(path("masks/s2.pfm"));
    const Ran work = penumbra({"batch", path("scenes"), "--out", path("masks"), "--format", "pfm"});
    EXPECT_EQ(work.code, 1) << work.err;
    EXPECT_NE(work.err.find("2 of 3 scenes failed"), std::string::npos) << work.err;
    EXPECT_EQ(statuses("masks/manifest.jsonl"), (Statuses{{"s0.json", "done"}, {"s1.json", "failed"}, {"s2.json", "failed"}}));
}

TEST_F(BatchCommand, ResumeComputesWhatIsMissingOrOutOfDate)
{
    write_scenes(3);
    EXPECT_EQ(penumbra({"batch", path("scenes"), "--out", path("masks")}).code, 0);
    fs::remove(path("masks/s0.exr"));
    touch("scenes/s1.json", std::chrono::seconds(60));
    const Ran ran = penumbra({"batch", path("scenes"), "--out", path("masks"), "--resume"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(statuses("masks/manifest.jsonl"), (Statuses{{"s0.json", "done"}, {"s1.json", "done"}, {"s2.json", "skipped"}}));

    // With nothing to do no device is asked for.
    touch("scenes/s1.json", std::chrono::seconds(-60));
    EXPECT_EQ(penumbra({"batch", path("scenes"), "--out", path("masks"), "--resume"}, no_device).code, 0);
    EXPECT_EQ(statuses("masks/manifest.jsonl"), (Statuses{{"s0.json", "skipped"}, {"s1.json", "skipped"}, {"s2.json", "skipped"}}));
}

TEST_F(BatchCommand, ShardsAreAPartition)
{
    write_scenes(5);
    for (const std::string shard : {"1/3", "2/3", "3/3"})
        EXPECT_EQ(penumbra({"batch", path("scenes"), "--out", path("masks"), "--shard", shard}).code, 0);
    EXPECT_EQ(statuses("masks/manifest-1-of-3.jsonl"), (Statuses{{"s0.json", "done"}, {"s3.json", "done"}}));
    EXPECT_EQ(statuses("masks/manifest-2-of-3.jsonl"), (Statuses{{"s1.json", "done"}, {"s4.json", "done"}}));
    EXPECT_EQ(statuses("masks/manifest-3-of-3.jsonl"), (Statuses{{"s2.json", "done"}}));

    // More shards than scenes: the last ones have nothing to do.
    EXPECT_EQ(penumbra({"batch", path("scenes"), "--out", path("masks"), "--shard", "9/9"}, no_device).code, 0);
}

TEST_F(BatchCommand, Refuses)
{
    const std::string masks = path("masks");
    expect_one_error(penumbra({"batch", path("scenes"), "--out", masks}), 2, {"no scenes"});
    expect_one_error(penumbra({"batch", path("none"), "--out", masks}), 2, {path("none")});
    write_scenes(2);
    expect_one_error(penumbra({"batch", path("scenes/s0.json"), "--out", masks}), 2, {"penumbra mask"});
    for (const std::string shard : {"0/2", "3/2", "1/0", "1", "a/b", "1/2/3", "-1/2", "1/"})
        expect_one_error(penumbra({"batch", path("scenes"), "--out", masks, "--shard", shard}), 2, {"--shard " + shard, "I/N"});
    expect_one_error(penumbra({"batch", path("scenes"), "--out", masks, "--format", "jpg"}), 2, {"jpg", "exr"});
    expect_one_error(penumbra({"batch", path("scenes"), "--out", masks, "--technique", "auto"}), 2, {"auto"});

    fs::create_directory(path("scenes/more"));
    write_scene("scenes/more/s0.json");
    write_text(path("list.txt"), "scenes/s0.json\nscenes/more/s0.json\n");
    expect_one_error(penumbra({"batch", path("list.txt"), "--out", masks}), 2, {"both write", "s0.exr"});
    EXPECT_FALSE(fs::exists(masks));

    expect_one_error(penumbra({"batch", path("scenes"), "--out", masks}, no_device), 1, {"device"});
    expect_one_error(penumbra({"batch", path("scenes"), "--out", path("list.txt")}), 1, {"--out"});
}

TEST_F(BatchCommand, AnInterruptFinishesTheSceneAndWritesTheManifest)
{
    // Long enough a batch that a signal after the first mask comes before the last.
    const int count = 400;
    write_scenes(count);
    for (const auto& [signal, code] : {std::pair{SIGTERM, 143}, std::pair{SIGINT, 130}}) {
        fs::remove_all(path("masks"));
        const int process = start({"batch", path("scenes"), "--out", path("masks")});
        while (!fs::exists(path("masks/s0.exr")) && ::kill(process, 0) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        ASSERT_EQ(::kill(process, signal), 0);
        EXPECT_EQ(wait_for(process), code);

        int done = 0, pending = 0;
        for (const auto& [scene, status] : statuses("masks/manifest.jsonl")) {
            done += status == "done" ? 1 : 0;
            pending += status == "pending" ? 1 : 0;
            const std::string mask = path("masks/" + fs::path(scene).stem().string() + ".exr");
            EXPECT_EQ(fs::exists(mask), status == "done") << scene;
            if (status == "done") {
                EXPECT_EQ(read_image(mask).width, 40);
            }
        }
        EXPECT_GE(done, 1);
        EXPECT_GE(pending, 1);
        EXPECT_EQ(done + pending, count);
        // Every mask and the manifest; no leftovers of half-written files.
        EXPECT_EQ(files("masks").size(), static_cast<std::size_t>(done) + 1);
    }
}

TEST_F(BatchCommand, ProgressIsForTerminalsOnly)
{
    write_scenes(2);
    const Ran ran = penumbra_on_terminal({"batch", path("scenes"), "--out", path("masks")});
    EXPECT_EQ(ran.code, 0) << ran.out;
    EXPECT_NE(ran.out.find("[####################] 100 %  2/2"), std::string::npos) << ran.out;
    EXPECT_NE(ran.out.find("/s  0 s left"), std::string::npos) << ran.out;
}

} // namespace
} // namespace penumbra::test
