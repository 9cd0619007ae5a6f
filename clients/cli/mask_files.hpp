// Which masks of a scene are asked for, and the files that they go to.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/scene.hpp>

namespace penumbra::cli {

// --light and --frame; without them all.
struct MaskChoice {
    std::string light;
    int frame = 0;
};

// One of the masks of a scene, and its files.
struct MaskFile {
    std::string light; // empty: all together, or the only one
    int frame = 0;     // 0: there is no sequence
    std::string file;
    std::string bound = {}, preview = {}; // of --bound and --preview; empty: not wanted
};

// `out.exr`, with `.<light>` and `.<frame>` (four digits) before its extension where they are given.
std::string mask_file(const std::string& output, std::string_view light, int frame);

// The masks that the scene's JSON leads to, in the order of their making. What is no scene counts as one with one mask: its own error comes
// when it is read.
std::vector<MaskFile> mask_files(const std::string& output, const nlohmann::json& scene, const MaskChoice& choice = {});

// The scene with the light and the frame of the choice alone. Throws usage naming the flag.
Scene chosen(Scene scene, const MaskChoice& choice);

} // namespace penumbra::cli
