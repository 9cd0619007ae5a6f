#include "masks.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include <penumbra/error.hpp>

#include "digest.hpp"
#include "engine/state.hpp"
#include "io/scene_file.hpp"
#include "problem.hpp"
#include "resources.hpp"
#include "scene/light_space.hpp"
#include "work_limits.hpp"

namespace penumbra::server {
namespace {

// A stage's name as a token of Server-Timing.
std::string token_of(std::string_view name)
{
    std::string token;
    for (const char c : name) token += (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ? c : '-';
    return token;
}

// How a mask of that scene is encoded in that format.
OutputFormat encoding_of(const MaskTask& task, const MaskFormat& format)
{
    const std::string_view wanted = task.output.format == "tiff" ? std::string_view("tif") : std::string_view(task.output.format);
    return {std::string(format.format), wanted == format.format ? task.output.bits : 0};
}

std::shared_ptr<const Receivers> rendered_receivers(const MaskTask& task, std::vector<Stage>& stages)
{
    if (task.cache)
        if (auto kept = task.cache->receivers(task.receivers_key)) return kept;
    const Stopwatch watch;
    auto receivers = std::make_shared<const Receivers>(with_depth(*task.receivers, task.light, task.geometry));
    stages.push_back({"render depth", watch.ms(), 0, 0});
    if (task.cache) task.cache->keep(task.receivers_key, receivers);
    return receivers;
}

Mask mask_of(const Engine& engine, const MaskTask& task, const Deadline& deadline)
{
    const bool kept = task.cache && task.cache->prepared(task.prepared_key);
    const Prepared prepared = prepare(engine, task, deadline);

    deadline.check("the receivers' depth");
    std::vector<Stage> stages;
    const auto receivers = rendered_receivers(task, stages);

    deadline.check("shading");
    Mask mask = engine.shade(prepared, *receivers);
    if (!kept) add_stages(stages, prepared.state().stages);
    add_stages(stages, mask.report.stages);
    mask.report.stages = std::move(stages);
    mask.report.warnings.insert(mask.report.warnings.begin(), task.warnings.begin(), task.warnings.end());
    return mask;
}

} // namespace

const Part* find_scene(std::span<const Part> parts, const Options& options)
{
    const auto part = std::ranges::find(parts, "scene", &Part::name);
    if (part == parts.end()) return nullptr;
    if (part->bytes.size() > static_cast<std::size_t>(options.scene_bytes))
        throw Problem(413, "scene_bytes",
                      "part scene has " + std::to_string(part->bytes.size()) + " bytes; the limit is " +
                          std::to_string(options.scene_bytes));
    return &*part;
}

Scene decode_scene(std::span<const Part> parts, const Options& options, const Deadline& deadline)
{
    const Part* const part = find_scene(parts, options);
    if (!part) throw Problem(400, "no_scene_part", "the request has no part named scene; expected the scene's JSON");
    const RequestResources resources(parts, options, deadline);
    return resources.without_paths([&] { return parse_scene(part->bytes, resources); });
}

MaskTask task_of(std::span<const Part> parts, const Options& options, const Deadline& deadline)
{
    Scene scene = decode_scene(parts, options, deadline);
    const Vec3 origin = light_frame(scene.light).origin;
    return {.light = std::move(scene.light),
            .occluders = std::make_shared<const Occluders>(std::move(scene.occluders)),
            .receivers = std::make_shared<const Receivers>(std::move(scene.receivers)),
            .geometry = Geometry(std::move(scene.objects), origin),
            .technique = technique_from(scene.technique),
            .output = scene.output,
            .warnings = std::move(scene.warnings),
            .cache = nullptr,
            .prepared_key = {},
            .receivers_key = {}};
}

Prepared prepare(const Engine& engine, const MaskTask& task, const Deadline& deadline)
{
    if (task.cache)
        if (const auto kept = task.cache->prepared(task.prepared_key)) return *kept;
    deadline.check("preparing");
    const Prepared prepared = engine.prepare(task.light, *task.occluders, task.geometry, task.technique);
    if (task.cache) task.cache->keep(task.prepared_key, prepared);
    return prepared;
}

MaskReply compute_mask(const Engine& engine, const MaskTask& task, const MaskFormat& format, const Options& options,
                       const Deadline& deadline)
{
    check_work(*task.occluders, *task.receivers, task.technique, options);
    MaskReply reply;
    const Stopwatch computing;
    const Mask mask = mask_of(engine, task, deadline);
    reply.compute_ms = computing.ms();

    deadline.check("encoding the mask");
    const Stopwatch encoding;
    const std::vector<std::byte> bytes = encode_image(mask.visibility, encoding_of(task, format));
    reply.bytes.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    reply.encode_ms = encoding.ms();

    reply.technique = mask.report.technique;
    reply.pixels = mask.visibility.pixel_count();
    reply.device_bytes = mask.report.peak_device_bytes;
    reply.warnings = mask.report.warnings;
    for (const Stage& stage : mask.report.stages) reply.stages.push_back({token_of(stage.name), stage.ms});
    reply.stages.push_back({"encode", reply.encode_ms});
    return reply;
}

std::string etag_of(const Engine& engine, std::string_view content, const MaskFormat& format)
{
    Digest digest;
    digest.add(content).add(format.format).add(version()).add(engine.device().name).add(engine.device().driver);
    return "\"sha256-" + digest.hex() + "\"";
}

bool names_tag(std::string_view header, std::string_view tag)
{
    for (std::size_t at = header.find(tag); at != std::string_view::npos; at = header.find(tag, at + 1)) return true;
    return header == "*";
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
