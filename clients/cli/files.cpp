#include "files.hpp"

#include <filesystem>
#include <map>
#include <span>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/image_format.hpp"
#include "io/image_io.hpp"

namespace penumbra::cli {

namespace fs = std::filesystem;

void require_place_for(const std::string& path, std::string_view flag)
{
    const std::string at = std::string(flag) + " " + path;
    std::error_code ignored;
    if (path.empty()) throw Error(ErrorCode::usage, std::string(flag) + ": expected a file name");
    if (fs::is_directory(path, ignored)) throw Error(ErrorCode::usage, at + ": is a folder, expected a file name");
    const fs::path folder = fs::path(path).has_parent_path() ? fs::path(path).parent_path() : fs::path(".");
    if (!fs::is_directory(folder, ignored))
        throw Error(ErrorCode::usage, at + ": the folder " + folder.string() + " is not there", "make it first");
}

void require_different(const std::string& path, std::string_view flag, const std::string& other, std::string_view other_flag)
{
    std::error_code error, ignored;
    const bool same = fs::equivalent(path, other, ignored) || fs::weakly_canonical(path, error) == fs::weakly_canonical(other, error);
    if (same && !error)
        throw Error(ErrorCode::usage, std::string(flag) + " " + path + ": is the same file as " + std::string(other_flag) + " " + other);
}

nlohmann::json json_in(const std::string& scene)
{
    try {
        const std::vector<std::byte> bytes = read_file(scene, scene);
        const auto* text = reinterpret_cast<const char*>(bytes.data());
        nlohmann::json json = nlohmann::json::parse(text, text + bytes.size(), nullptr, false);
        return json.is_discarded() ? nlohmann::json() : json;
    } catch (const Error&) {
        return {};
    }
}

void require_not_named_in(const std::string& scene, const nlohmann::json& json, const std::vector<std::string>& paths,
                          std::string_view flag)
{
    std::error_code ignored;
    std::map<fs::path, std::string> targets;
    for (const std::string& path : paths)
        if (fs::exists(path, ignored)) targets.emplace(fs::weakly_canonical(path, ignored), path);
    if (targets.empty() || !json.is_structured()) return;

    const fs::path folder = fs::path(scene).parent_path();
    const nlohmann::json leaves = json.flatten();
    for (const auto& [key, value] : leaves.items()) {
        if (!value.is_string()) continue;
        const auto found = targets.find(fs::weakly_canonical(folder / value.get<std::string>(), ignored));
        if (found == targets.end()) continue;
        throw Error(ErrorCode::usage,
                    std::string(flag) + " " + found->second + ": would replace what " + scene + " is made from (" + key + ")");
    }
}

OutputFormat format_for(const std::string& path, const OutputFormat& wanted, std::string_view flag)
{
    try {
        OutputFormat format = by_extension({}, path);
        if (wanted.bits != 0 &&
            (wanted.format.empty() || format_of(checked({wanted.format, 0}, "output.format")) == format_of(checked(format, ""))))
            format.bits = wanted.bits;
        return checked(format, path);
    } catch (const Error& error) {
        throw Error(error.code(), std::string(flag) + " " + error.message(), error.hint());
    }
}

void make_folder(const std::string& path, std::string_view flag)
{
    std::error_code error;
    fs::create_directories(path, error);
    if (!fs::is_directory(path)) {
        const std::string reason = error ? error.message() : "is a file, expected a folder";
        throw Error(ErrorCode::output, std::string(flag) + " " + path + ": " + reason);
    }
}

void write_text(const std::string& path, std::string_view text) { write_file(path, std::as_bytes(std::span(text.data(), text.size()))); }

Scene read_scene(const std::string& path)
{
    return in_scene(path, [&] { return load_scene(path); });
}

} // namespace penumbra::cli
