#include "batch_list.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <system_error>

#include <nlohmann/json.hpp>

#include <penumbra/error.hpp>

#include "files.hpp"
#include "io/image_format.hpp"
#include "io/image_io.hpp"
#include "io/words.hpp"
#include "mask_files.hpp"

namespace penumbra::cli {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> scenes_in_folder(const fs::path& folder)
{
    std::vector<std::string> scenes;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".json" && !entry.is_directory()) scenes.push_back(entry.path().string());
    std::ranges::sort(scenes);
    return scenes;
}

std::string_view trimmed(std::string_view line)
{
    constexpr std::string_view blank = " \t\r";
    const std::size_t first = line.find_first_not_of(blank);
    return first == std::string_view::npos ? std::string_view{} : line.substr(first, line.find_last_not_of(blank) - first + 1);
}

std::vector<std::string> scenes_in_list(const fs::path& list)
{
    const std::vector<std::byte> bytes = read_file(list.string(), list.string());
    std::string_view text = without_byte_order_mark({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    std::vector<std::string> scenes;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        const std::string_view line = trimmed(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
        if (!line.empty() && line.front() != '#') scenes.push_back((list.parent_path() / line).string());
    }
    return scenes;
}

// The format that the scene asks for; exr when it asks for none. A scene that cannot be read or asks for what does not exist gets exr here
// and its error when its turn comes.
std::string output_format(const nlohmann::json& scene)
{
    try {
        return checked({scene.at("output").at("format").get<std::string>(), 0}, "").format;
    } catch (const Error&) {
    } catch (const nlohmann::json::exception&) {
    }
    return "exr";
}

std::size_t number_in(std::string_view text, std::string_view part)
{
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
    if (error != std::errc{} || end != part.data() + part.size())
        throw Error(ErrorCode::usage, "--shard " + std::string(text) + ": expected I/N, such as 1/4");
    return number;
}

} // namespace

Shard parse_shard(std::string_view text)
{
    if (text.empty()) return {};
    const std::size_t slash = std::min(text.find('/'), text.size());
    const Shard shard{number_in(text, text.substr(0, slash)), number_in(text, text.substr(std::min(slash + 1, text.size())))};
    if (shard.number < 1 || shard.number > shard.count)
        throw Error(ErrorCode::usage, "--shard " + std::string(text) + ": expected I/N with I from 1 to N");
    return shard;
}

std::vector<BatchItem> batch_items(const std::string& source, const std::string& folder, const std::string& format)
{
    std::error_code ignored;
    const bool is_folder = fs::is_directory(source, ignored);
    if (!is_folder && fs::path(source).extension() == ".json")
        throw Error(ErrorCode::usage, source + ": is a scene, expected a folder of scenes or a list of them", "one scene: penumbra mask");
    const std::vector<std::string> scenes = is_folder ? scenes_in_folder(source) : scenes_in_list(source);
    if (scenes.empty()) throw Error(ErrorCode::usage, source + ": has no scenes", "a folder of .json files, or a list with a path a line");

    std::vector<BatchItem> items;
    std::map<std::string, std::string> writers;
    for (const std::string& scene : scenes) {
        const nlohmann::json json = json_in(scene);
        const std::string extension = format.empty() ? output_format(json) : format;
        BatchItem item{scene, (fs::path(folder) / (fs::path(scene).stem().string() + "." + extension)).string(), {}};
        for (const MaskFile& mask : mask_files(item.output, json)) {
            const auto [writer, is_new] = writers.emplace(mask.file, scene);
            if (!is_new)
                throw Error(ErrorCode::usage, scene + " and " + writer->second + " would both write " + mask.file,
                            "give them different names");
            item.outputs.push_back(mask.file);
        }
        items.push_back(std::move(item));
    }
    return items;
}

std::vector<BatchItem> items_of(const Shard& shard, const std::vector<BatchItem>& items)
{
    std::vector<BatchItem> part;
    for (std::size_t i = shard.number - 1; i < items.size(); i += shard.count) part.push_back(items[i]);
    return part;
}

bool up_to_date(const BatchItem& item)
{
    std::error_code no_scene;
    const auto scene = fs::last_write_time(item.scene, no_scene);
    return !no_scene && std::ranges::all_of(item.outputs, [&](const std::string& output) {
        std::error_code no_output;
        const auto written = fs::last_write_time(output, no_output);
        return !no_output && written >= scene;
    });
}

} // namespace penumbra::cli
