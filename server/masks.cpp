#include "masks.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <optional>

#include <penumbra/error.hpp>

#include "engine/geometry.hpp"
#include "engine/state.hpp"
#include "io/scene_file.hpp"
#include "problem.hpp"
#include "resources.hpp"
#include "technique/occluder_maps.hpp"

namespace penumbra::server {
namespace {

constexpr std::array formats{MaskFormat{"image/png", "png"}, MaskFormat{"image/x-exr", "exr"}, MaskFormat{"image/tiff", "tif"},
                             MaskFormat{"image/x-portable-floatmap", "pfm"}};

std::string_view trimmed(std::string_view text)
{
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
    return text;
}

bool same(std::string_view a, std::string_view b)
{
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    return std::ranges::equal(a, b, [&](char x, char y) { return lower(x) == lower(y); });
}

// The part of `text` before `separator`, which is taken off.
std::string_view take(std::string_view& text, char separator)
{
    const std::size_t end = std::min(text.find(separator), text.size());
    const std::string_view piece = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    return piece;
}

// Weight of a media range, from its parameters; what is no number weighs nothing.
double weight_of(std::string_view parameters)
{
    while (!parameters.empty()) {
        const std::string_view piece = take(parameters, ';');
        if (piece.size() < 2 || !same(piece.substr(0, 2), "q=")) continue;
        double q = 0;
        const auto [end, error] = std::from_chars(piece.data() + 2, piece.data() + piece.size(), q);
        return error == std::errc{} && end == piece.data() + piece.size() && q >= 0 && q <= 1 ? q : 0;
    }
    return 1;
}

// How closely a media range names a type: 0 not at all, 1 */*, 2 image/*, 3 itself.
int closeness(std::string_view range, std::string_view type)
{
    if (same(range, type)) return 3;
    if (same(range, "image/*")) return 2;
    return range == "*/*" ? 1 : 0;
}

// The closest range decides the weight of a type.
double weight_for(std::string_view accept, std::string_view type)
{
    int closest = 0;
    double weight = 0;
    while (!accept.empty()) {
        std::string_view parameters = take(accept, ',');
        const std::string_view range = take(parameters, ';');
        const int close = closeness(range, type);
        if (close <= closest) continue;
        closest = close;
        weight = weight_of(parameters);
    }
    return weight;
}

std::string side_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

void check_pixels(std::string_view where, int width, int height, std::int64_t limit)
{
    if (static_cast<std::int64_t>(width) * height > limit)
        throw Error(ErrorCode::too_large, std::string(where) + ": is " + side_text(width, height),
                    "the limit of the service is " + std::to_string(limit) + " pixels");
}

void check_amount(std::string_view where, double amount, std::string_view what, std::int64_t limit)
{
    if (amount <= static_cast<double>(limit)) return;
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", amount);
    throw Error(ErrorCode::too_large, std::string(where) + ": asks for " + text.data() + " " + std::string(what),
                "the limit of the service is " + std::to_string(limit));
}

struct WorkCheck {
    const Scene& scene;
    const Options& options;
    double pixels() const { return static_cast<double>(scene.receivers.width) * scene.receivers.height; }

    void operator()(const ShadowMap&) const {}
    void operator()(const SoftShadowMap& settings) const
    {
        const MapSize map = reduced_size(scene.occluders.width, scene.occluders.height, settings.resolution);
        const double texels = static_cast<double>(map.width) * map.height * (settings.sides == Sides::both ? 2 : 1);
        if (settings.project)
            check_pixels("technique.project_resolution", settings.project_resolution, settings.project_resolution, options.receivers);
        const double receivers =
            settings.project ? static_cast<double>(settings.project_resolution) * settings.project_resolution : pixels();
        check_amount("receivers.resolution", texels * receivers, "pairs of occluder texel and receiver", options.pairs);
    }
    void operator()(const RayTraced& settings) const
    {
        check_amount("technique.samples", pixels() * settings.samples, "rays", options.rays);
    }
};

// A stage's name as a token of Server-Timing.
std::string token_of(std::string_view name)
{
    std::string token;
    for (const char c : name) token += (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ? c : '-';
    return token;
}

Scene decode(std::span<const Part> parts, const Options& options, const Deadline& deadline)
{
    const auto part = std::ranges::find(parts, "scene", &Part::name);
    if (part == parts.end()) throw Problem(400, "no_scene", "the request has no part named scene; expected the scene's JSON");
    if (part->bytes.size() > static_cast<std::size_t>(options.scene_bytes))
        throw Problem(413, "scene_bytes",
                      "part scene has " + std::to_string(part->bytes.size()) + " bytes; the limit is " +
                          std::to_string(options.scene_bytes));
    const RequestResources resources(parts, options, deadline);
    try {
        return parse_scene(part->bytes, resources);
    } catch (const Error& error) {
        // A mesh reader's complaint may name the file that we gave it.
        std::string message = error.message();
        const std::string folder = resources.folder().empty() ? "" : resources.folder().string() + "/";
        for (std::size_t at = 0; !folder.empty() && (at = message.find(folder, at)) != std::string::npos;) message.erase(at, folder.size());
        throw Error(error.code(), message, error.hint());
    }
}

// Engine::mask step by step, so that the deadline can be looked at between steps.
Mask mask_before(const Engine& engine, const Scene& scene, const Deadline& deadline)
{
    const Geometry geometry = view_of(scene);
    deadline.check("preparing");
    const Prepared prepared = engine.prepare(scene.light, scene.occluders, geometry, technique_from(scene.technique));

    deadline.check("the receivers' depth");
    const Stopwatch watch;
    const Receivers receivers = with_depth(scene.receivers, scene.light, geometry);
    std::vector<Stage> stages{{"render depth", watch.ms(), 0, 0}};

    deadline.check("shading");
    Mask mask = engine.shade(prepared, receivers);
    add_stages(stages, prepared.state().stages);
    add_stages(stages, mask.report.stages);
    mask.report.stages = std::move(stages);
    mask.report.warnings.insert(mask.report.warnings.begin(), scene.warnings.begin(), scene.warnings.end());
    return mask;
}

} // namespace

std::span<const MaskFormat> mask_formats() { return formats; }

const MaskFormat& negotiate(std::string_view accept)
{
    if (trimmed(accept).empty()) return formats.front();
    const MaskFormat* best = nullptr;
    double best_weight = 0;
    for (const MaskFormat& format : formats) {
        const double weight = weight_for(accept, format.media_type);
        if (weight <= best_weight) continue;
        best = &format;
        best_weight = weight;
    }
    if (best) return *best;
    std::string list;
    for (const MaskFormat& format : formats) list += (list.empty() ? "" : ", ") + std::string(format.media_type);
    throw Problem(406, "not_acceptable", "Accept: names no format of a mask; expected one of " + list);
}

void check_work(const Scene& scene, const Options& options)
{
    check_pixels("receivers.resolution", scene.receivers.width, scene.receivers.height, options.receivers);
    check_pixels("occluders.resolution", scene.occluders.width, scene.occluders.height, options.image_samples);
    std::visit(WorkCheck{scene, options}, technique_from(scene.technique));
}

MaskReply compute_mask(const Engine& engine, std::span<const Part> parts, const MaskFormat& format, const Options& options,
                       const Deadline& deadline)
{
    MaskReply reply;
    const Stopwatch decoding;
    const Scene scene = decode(parts, options, deadline);
    check_work(scene, options);
    reply.decode_ms = decoding.ms();

    const Stopwatch computing;
    const Mask mask = mask_before(engine, scene, deadline);
    reply.compute_ms = computing.ms();

    deadline.check("encoding the mask");
    const Stopwatch encoding;
    const std::string_view wanted = scene.output.format == "tiff" ? std::string_view("tif") : std::string_view(scene.output.format);
    const std::vector<std::byte> bytes =
        encode_image(mask.visibility, {std::string(format.format), wanted == format.format ? scene.output.bits : 0});
    reply.bytes.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    reply.encode_ms = encoding.ms();

    reply.technique = mask.report.technique;
    reply.pixels = mask.visibility.pixel_count();
    reply.warnings = mask.report.warnings;
    reply.stages.push_back({"decode", reply.decode_ms});
    for (const Stage& stage : mask.report.stages) reply.stages.push_back({token_of(stage.name), stage.ms});
    reply.stages.push_back({"encode", reply.encode_ms});
    return reply;
}

std::string server_timing(const std::vector<StageTime>& stages)
{
    std::string text;
    for (const StageTime& stage : stages) {
        std::array<char, 32> number{};
        std::snprintf(number.data(), number.size(), "%.3f", stage.ms);
        text += (text.empty() ? "" : ", ") + stage.name + ";dur=" + number.data();
    }
    return text;
}

} // namespace penumbra::server
