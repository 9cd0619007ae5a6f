// Runs the real `penumbra` and keeps what it said. Scenes are written into a temporary folder.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace penumbra::test {

struct Ran {
    int code = -1; // the exit code, or 128 + the signal
    std::string out, err;
};

using Arguments = std::vector<std::string>;
using Environment = std::vector<std::pair<std::string, std::string>>;

// PENUMBRA_CLI with these arguments; `environment` is set on top of ours.
Ran penumbra(const Arguments& arguments, const Environment& environment = {});

// The same on a terminal of its own: what it draws there is in `out`.
Ran penumbra_on_terminal(const Arguments& arguments);

// Starts it, with standard output and error going nowhere; and waits for it (the code as in Ran).
int start(const Arguments& arguments);
int wait_for(int process);

// No OpenCL platform is found with this.
inline const Environment no_device{{"OCL_ICD_VENDORS", "/nonexistent"}, {"OPENCL_VENDOR_PATH", "/nonexistent"}};

std::string text_of(const std::string& path);
// Masks of the same receivers, rendered or read back from an image: what is read is fitted and lifted by up to .6 of a pixel (docs/depth.md), so
// that pixels on the shadow's border may see more or less of the light. Their share of these images is below a twentieth, and they move by less than a
// fifth on average: .01.
void expect_alike(const std::string& path, const std::string& other);

void expect_same_bytes(const std::string& path, const std::string& other);
void write_text(const std::string& path, const std::string& text);

// A folder that is gone afterwards.
class CommandTest : public ::testing::Test {
protected:
    explicit CommandTest(const std::string& below = {}); // with this folder in it
    ~CommandTest() override;

    std::string path(const std::string& name) const { return folder_ + "/" + name; }
    std::vector<std::string> files(const std::string& below = "") const; // names, sorted

    // A square light over a floor with a quad between them; quads only. Returns the path.
    std::string write_scene(const std::string& name, const std::string& technique = R"({"kind": "soft_shadow_map"})",
                            const std::string& more = "", double height = 2) const;

private:
    std::string folder_;
};

// One line on standard error that starts with "penumbra: " and holds every one of `parts`; nothing on standard output.
void expect_one_error(const Ran& ran, int code, const std::vector<std::string>& parts);

} // namespace penumbra::test
