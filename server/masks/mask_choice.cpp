#include "masks/mask_choice.hpp"

#include <algorithm>
#include <charconv>

#include "process/problem.hpp"

namespace penumbra::server {
namespace {

bool is_name(const std::string& text)
{
    const auto fits = [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    };
    return !text.empty() && text.size() <= 64 && std::ranges::all_of(text, fits);
}

int frame_number(const std::string& text)
{
    int number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{} || end != text.data() + text.size() || number < 1 || number > static_cast<int>(max_frames))
        throw Problem(400, "no_frame", "frame: is no number of a frame; expected 1 to " + std::to_string(max_frames) + " in the query");
    return number;
}

MaskImage image_named(const std::string& text)
{
    if (text == "mask") return MaskImage::mask;
    if (text == "bound") return MaskImage::bound;
    throw Problem(400, "no_image", "image: is no image that a mask comes with; expected mask or bound in the query");
}

} // namespace

MaskChoice choice_from(const std::vector<std::pair<std::string, std::string>>& query)
{
    MaskChoice choice;
    for (const auto& [key, value] : query) {
        if (key != "light" && key != "frame" && key != "image" && key != "error_estimate")
            throw Problem(400, "query", "the query has an unknown parameter; known: light, frame, image, error_estimate");
        if (std::ranges::count(query, key, [](const auto& parameter) { return parameter.first; }) > 1)
            throw Problem(400, "query", key + ": stands twice in the query");
        if (key == "frame") {
            choice.frame = frame_number(value);
        } else if (key == "image") {
            choice.image = image_named(value);
        } else if (key == "error_estimate") {
            if (value != "true" && value != "false") throw Problem(400, "query", "error_estimate: is neither; expected true or false in the query");
            choice.error_estimate = value == "true";
        } else {
            if (!is_name(value)) throw Problem(400, "no_light", "light: is no name; expected 1 to 64 of A-Z a-z 0-9 _ - in the query");
            choice.light = value;
        }
    }
    return choice;
}

std::vector<std::size_t> chosen_from(const std::vector<Choosable>& lights, const MaskChoice& choice)
{
    std::vector<std::size_t> chosen;
    std::string names;
    int all_frames = 0, frames = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        names += (names.empty() ? "" : ", ") + lights[i].name;
        all_frames = std::max(all_frames, lights[i].frames);
        if (!choice.light.empty() && lights[i].name != choice.light) continue;
        chosen.push_back(i);
        frames = std::max(frames, lights[i].frames);
    }
    if (chosen.empty())
        throw Problem(400, "no_light",
                      "light: the scene has none named " + choice.light +
                          (names.empty() ? "; its only one has no name" : "; expected one of " + names));
    const std::string count = "the scene is a sequence of " + std::to_string(all_frames) +
                              " images; expected frame=1 to frame=" + std::to_string(all_frames) + " in the query";
    if (choice.frame > 0 && all_frames == 0)
        throw Problem(400, "no_frame", "frame: is " + std::to_string(choice.frame) + ", and the scene has no sequence");
    if (choice.frame > all_frames) throw Problem(400, "no_frame", "frame: is " + std::to_string(choice.frame) + ", and " + count);
    if (choice.frame == 0 && frames > 0) throw Problem(400, "no_frame", "frame: is missing, and " + count);
    return chosen;
}

} // namespace penumbra::server
