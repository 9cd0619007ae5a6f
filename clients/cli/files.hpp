// Checks of file arguments, made before any work is done.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/error.hpp>
#include <penumbra/image.hpp>
#include <penumbra/scene.hpp>

namespace penumbra::cli {

// The folder that `path` is to be written into is there, and `path` is no folder itself. Throws usage, starting with the flag.
void require_place_for(const std::string& path, std::string_view flag);

// Throws usage when both name one file.
void require_different(const std::string& path, std::string_view flag, const std::string& other, std::string_view other_flag);

// The scene file's JSON; null for what cannot be read, the error of which comes when it is loaded.
nlohmann::json json_in(const std::string& scene);

// No string in the scene's JSON leads to one of `paths`: results never replace what they are made from. Throws usage.
void require_not_named_in(const std::string& scene, const nlohmann::json& json, const std::vector<std::string>& paths,
                          std::string_view flag);

// How to write an image to `path`: the format of its extension; the bits of `wanted` where that is for the same format. Throws usage.
OutputFormat format_for(const std::string& path, const OutputFormat& wanted, std::string_view flag);

// Makes the folder, and those that lead to it, unless it is there. Throws output.
void make_folder(const std::string& path, std::string_view flag);

// Whole or not at all.
void write_text(const std::string& path, std::string_view text);

// load_scene, the errors of which name the file.
Scene read_scene(const std::string& path);

// Runs `work`; errors about the input have their place in the scene's file.
template <class Work> auto in_scene(const std::string& path, const Work& work)
{
    try {
        return work();
    } catch (const Error& error) {
        if (exit_code(error.code()) != 2) throw;
        throw error.within(path);
    }
}

} // namespace penumbra::cli
