#include "io/depth_channel.hpp"

#include <algorithm>
#include <array>
#include <cctype>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

constexpr std::size_t longest_list = 400; // characters of a list of channels in a message

Error broken(std::string_view where, const std::string& what, std::string hint = {})
{
    return {ErrorCode::invalid_input, std::string(where) + " " + what, std::move(hint)};
}

std::string lower(std::string_view text)
{
    std::string result(text);
    std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return result;
}

// "ViewLayer.Depth.Z": layer ViewLayer.Depth, component Z.
struct ChannelName {
    std::string layer, component;
};

ChannelName split(const std::string& name)
{
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos) return {"", name};
    return {name.substr(0, dot), name.substr(dot + 1)};
}

bool is_alpha(const std::string& channel)
{
    const std::string component = lower(split(channel).component);
    return component == "a" || component == "alpha";
}

// Whether a layer's name, without the layers around it, ends in one of these words: FinalImage_WorldDepth. Short ones must stand alone.
bool ends_in_word(std::string_view layer, std::span<const std::string_view> words)
{
    constexpr std::size_t telling = 6; // letters of a word that is found at the end of others as well: ZDepth in VRayZDepth
    const std::string name = lower(split(std::string(layer)).component);
    return std::ranges::any_of(words, [&](std::string_view word) {
        if (!name.ends_with(word)) return false;
        const std::size_t before = name.size() - word.size();
        return before == 0 || word.size() >= telling ||
               (word.size() > 1 && std::isalnum(static_cast<unsigned char>(name[before - 1])) == 0);
    });
}

constexpr std::array<std::string_view, 7> depth_words{"depth", "zdepth", "worlddepth", "scenedepth", "lineardepth", "cameradepth", "z"};
constexpr std::array<std::string_view, 6> position_words{"p", "position", "worldposition", "worldpos", "positionworld", "pworld"};

bool means_depth(std::string_view name) { return ends_in_word(name, depth_words); }

bool any_channel(const ImagePart& part, const std::string& layer, std::string_view component)
{
    return std::ranges::any_of(part.channels, [&](const std::string& channel) {
        const ChannelName name = split(channel);
        return name.layer == layer && lower(name.component) == component;
    });
}

// Whether a channel without a layer is depth by its own name. In a part with a name of its own that would be its layer, but for pictures'.
bool is_bare_depth(const ImagePart& part, const std::string& channel, bool several)
{
    if (!means_depth(channel)) return false;
    if (any_channel(part, "", "x") && any_channel(part, "", "y")) return false; // a vector's
    return !several || part.name.empty() || means_depth(part.name) || (any_channel(part, "", "r") && any_channel(part, "", "g")) ||
           lower(channel) != "z";
}

// The channel of a layer of depth that has it: depth.Z, Depth.V, ZDepth.R. -1: none.
int depth_of_layer(const ImagePart& part, const std::string& layer)
{
    constexpr std::array<std::string_view, 7> components{"z", "v", "y", "r", "d", "depth", "distance"};
    for (const std::string_view component : components)
        for (std::size_t i = 0; i < part.channels.size(); ++i) {
            const ChannelName name = split(part.channels[i]);
            if (name.layer == layer && lower(name.component) == component) return static_cast<int>(i);
        }
    return -1;
}

// The layers of a part, each once.
std::vector<std::string> layers_of(const ImagePart& part)
{
    std::vector<std::string> layers;
    for (const std::string& channel : part.channels)
        if (const std::string layer = split(channel).layer; std::ranges::find(layers, layer) == layers.end()) layers.push_back(layer);
    return layers;
}

// All that is depth by name in a part.
void add_depth(const ImagePart& part, int number, bool several, std::vector<PlanePick>& found)
{
    for (const std::string& layer : layers_of(part)) {
        const std::string& own = layer.empty() && several ? part.name : layer;
        if (!own.empty() && means_depth(own)) {
            if (const int channel = depth_of_layer(part, layer); channel >= 0) found.push_back({number, {channel}});
            continue;
        }
        for (std::size_t i = 0; i < part.channels.size(); ++i) {
            const ChannelName name = split(part.channels[i]);
            if (name.layer != layer) continue;
            const bool whole =
                layer.empty() ? is_bare_depth(part, name.component, several) : name.component.size() > 1 && means_depth(name.component);
            if (whole) found.push_back({number, {static_cast<int>(i)}});
        }
    }
}

// The three of a layer, as X, Y, Z or R, G, B; empty: it has not all of them.
std::vector<int> triple_of(const ImagePart& part, const std::string& layer)
{
    for (const std::string_view components : {"xyz", "rgb"}) {
        std::vector<int> triple;
        for (const char component : components)
            for (std::size_t i = 0; i < part.channels.size(); ++i)
                if (const ChannelName name = split(part.channels[i]);
                    name.layer == layer && lower(name.component) == std::string(1, component))
                    triple.push_back(static_cast<int>(i));
        if (triple.size() == 3) return triple;
    }
    return {};
}

void add_positions(const ImagePart& part, int number, bool several, std::vector<PlanePick>& found)
{
    for (const std::string& layer : layers_of(part)) {
        const std::string& own = layer.empty() && several ? part.name : layer;
        if (own.empty() || !ends_in_word(own, position_words)) continue;
        if (std::vector<int> triple = triple_of(part, layer); !triple.empty()) found.push_back({number, std::move(triple)});
    }
}

// The only channel of the parts that is not alpha, or the only three.
void add_only(std::span<const ImagePart> parts, std::span<const int> among, Planes planes, std::vector<PlanePick>& found)
{
    PlanePick pick;
    std::size_t count = 0;
    for (const int number : among) {
        const ImagePart& part = parts[static_cast<std::size_t>(number)];
        for (std::size_t i = 0; i < part.channels.size(); ++i) {
            if (is_alpha(part.channels[i])) continue;
            ++count;
            pick = {number, {static_cast<int>(i)}};
        }
    }
    if (count == 1 && planes == Planes::depth) found.push_back(pick);
    if (count != 3 || planes != Planes::position) return;
    const ImagePart& part = parts[static_cast<std::size_t>(pick.part)];
    const std::string layer = split(part.channels[static_cast<std::size_t>(pick.channels[0])]).layer;
    if (std::vector<int> triple = triple_of(part, layer); !triple.empty()) found.push_back({pick.part, std::move(triple)});
}

// What is called as asked: channels, or layers of positions; with its part's name in front as well.
void add_named(const ImagePart& part, int number, const PlaneRequest& request, std::vector<PlanePick>& found)
{
    const std::string& asked = request.channel;
    if (request.planes == Planes::position) {
        for (const std::string& layer : layers_of(part))
            if (layer == asked || (layer.empty() && part.name == asked))
                if (std::vector<int> triple = triple_of(part, layer); !triple.empty()) found.push_back({number, std::move(triple)});
        return;
    }
    for (std::size_t i = 0; i < part.channels.size(); ++i)
        if (part.channels[i] == asked || (!part.name.empty() && part.name + "." + part.channels[i] == asked))
            found.push_back({number, {static_cast<int>(i)}});
}

std::string part_text(const ImagePart& part, std::size_t number)
{
    return "part " + std::to_string(number) + (part.name.empty() ? "" : " \"" + plain_line(part.name) + "\"");
}

std::string text(const PartChoice& choice)
{
    if (const int* const number = std::get_if<int>(&choice)) return std::to_string(*number);
    return "\"" + plain_line(std::get<std::string>(choice)) + "\"";
}

// The numbers of the parts that are looked at.
std::vector<int> chosen_parts(std::span<const ImagePart> parts, const PartChoice& choice, std::string_view where)
{
    std::vector<int> numbers;
    bool any_deep = false;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const bool fits = std::holds_alternative<std::monostate>(choice) ||
                          (std::get_if<int>(&choice) && std::get<int>(choice) == static_cast<int>(i)) ||
                          (std::get_if<std::string>(&choice) && std::get<std::string>(choice) == parts[i].name);
        if (!fits) continue;
        any_deep |= parts[i].deep;
        if (!parts[i].deep) numbers.push_back(static_cast<int>(i));
    }
    if (numbers.empty() && any_deep) throw broken(where, "is a deep image", "flatten it first");
    if (numbers.empty()) throw broken(where, "has no part " + text(choice) + "; it has " + channel_list(parts), "parts are counted from 0");
    return numbers;
}

[[noreturn]] void not_certain(std::span<const ImagePart> parts, const PlaneRequest& request, std::span<const PlanePick> found,
                              std::string_view where)
{
    const bool depth = request.planes == Planes::depth;
    const std::string list = channel_list(parts);
    if (found.empty() && !request.channel.empty())
        throw broken(where, std::string("has no ") + (depth ? "channel" : "layer of three channels") + " \"" + plain_line(request.channel) +
                                "\"; it has " + list);
    if (found.empty())
        throw broken(where, std::string("has no channel that is ") + (depth ? "depth" : "a position") + " for certain; it has " + list,
                     parts.size() > 1 ? "name one with encoding.channel, and its part with encoding.part"
                                      : "name one with encoding.channel");
    std::string several;
    bool other_parts = false;
    for (const PlanePick& pick : found) {
        const ImagePart& part = parts[static_cast<std::size_t>(pick.part)];
        other_parts |= pick.part != found.front().part;
        several += (several.empty() ? "" : ", ") + plain_line(part.channels[static_cast<std::size_t>(pick.channels[0])]) +
                   (parts.size() > 1 ? " in " + part_text(part, static_cast<std::size_t>(pick.part)) : "");
        if (several.size() > longest_list) {
            several += ", ...";
            break;
        }
    }
    throw broken(where, std::string("has more than one ") + (depth ? "depth" : "position") + ": " + several + "; it has " + list,
                 other_parts ? "choose one with encoding.part or encoding.channel" : "choose one with encoding.channel");
}

} // namespace

std::string plain_line(std::string text)
{
    while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
    std::ranges::replace_if(
        text, [](unsigned char c) { return c < 0x20 || c > 0x7e; }, ' ');
    return text.substr(0, 200);
}

std::string channel_list(std::span<const ImagePart> parts)
{
    std::string list;
    std::size_t left = 0;
    for (std::size_t number = 0; number < parts.size(); ++number) {
        bool first = true;
        for (const std::string& channel : parts[number].channels) {
            if (list.size() > longest_list) {
                ++left;
                continue;
            }
            if (first && parts.size() > 1) list += (list.empty() ? "" : "; ") + part_text(parts[number], number) + ": ";
            list += (first ? "" : ", ") + plain_line(channel).substr(0, 80);
            first = false;
        }
    }
    return left > 0 ? list + " and " + std::to_string(left) + " more" : list;
}

PlanePick pick_planes(std::span<const ImagePart> parts, const PlaneRequest& request, std::string_view where)
{
    const std::vector<int> among = chosen_parts(parts, request.part, where);
    std::vector<PlanePick> found;
    for (const int number : among) {
        const ImagePart& part = parts[static_cast<std::size_t>(number)];
        if (!request.channel.empty())
            add_named(part, number, request, found);
        else if (request.planes == Planes::depth)
            add_depth(part, number, parts.size() > 1, found);
        else
            add_positions(part, number, parts.size() > 1, found);
    }
    if (found.empty() && request.channel.empty()) add_only(parts, among, request.planes, found);
    if (found.size() != 1) not_certain(parts, request, found, where);
    return found.front();
}

} // namespace penumbra
