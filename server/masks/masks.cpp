#include "masks/masks.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include <penumbra/error.hpp>

#include "engine/state.hpp"
#include "engine/weighted_mean.hpp"
#include "io/scene_file.hpp"
#include "masks/digest.hpp"
#include "masks/resources.hpp"
#include "masks/work_limits.hpp"
#include "process/problem.hpp"
#include "scene/light_space.hpp"
#include "scene/lights.hpp"

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
    auto receivers = std::make_shared<const Receivers>(with_depth(*task.receivers, task.lights.front().light, task.geometry));
    stages.push_back({"render depth", watch.ms(), 0, 0});
    if (task.cache) task.cache->keep(task.receivers_key, receivers);
    return receivers;
}

// The mask of one of the task's lights; the first one renders the receivers.
Mask mask_of(const Engine& engine, const MaskTask& task, const TaskLight& light, std::shared_ptr<const Receivers>& receivers,
             const Deadline& deadline)
{
    std::vector<Stage> stages;
    const bool kept = task.cache && task.cache->prepared(light.key);
    const Prepared prepared = prepare(engine, task, light, deadline);

    if (!receivers) {
        deadline.check("the receivers' depth");
        receivers = rendered_receivers(task, stages);
    }
    deadline.check("shading");
    Mask mask = engine.shade(prepared, *receivers);
    if (!kept) add_stages(stages, prepared.state().stages);
    add_stages(stages, mask.report.stages);
    mask.report.stages = std::move(stages);
    return mask;
}

// Calls it with each light; what goes wrong with one of a list names its place.
template <class Call> void for_each_light(const MaskTask& task, const Call& call)
{
    for (const TaskLight& light : task.lights) try {
            call(light);
        } catch (const Error& error) {
            if (light.name.empty()) throw;
            throw in_list(error, light.place, light.own_occluders);
        }
}

// The mask of all the task's lights together.
Mask mask_of(const Engine& engine, const MaskTask& task, const Deadline& deadline)
{
    const bool alone = task.lights.size() == 1;
    std::shared_ptr<const Receivers> receivers;
    WeightedMean mean;
    Mask all;
    for_each_light(task, [&](const TaskLight& light) {
        Mask mask = mask_of(engine, task, light, receivers, deadline);
        if (!alone) mean.add(mask.visibility, light.weight);
        if (alone)
            all = std::move(mask);
        else
            add_report(all.report, mask.report, light.name, {});
    });
    if (!alone) all.visibility = mean.take();
    all.report.warnings.insert(all.report.warnings.begin(), task.warnings.begin(), task.warnings.end());
    return all;
}

std::vector<Choosable> choosable(const Scene& scene)
{
    if (scene.lights.empty()) return {{.name = {}, .frames = static_cast<int>(frames_of(scene.light))}};
    std::vector<Choosable> lights;
    for (const SceneLight& light : scene.lights) lights.push_back({light.name, static_cast<int>(frames_of(light.light))});
    return lights;
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

MaskTask task_of(std::span<const Part> parts, const MaskChoice& choice, const Options& options, const Deadline& deadline)
{
    Scene scene = decode_scene(parts, options, deadline);
    const auto shared = std::make_shared<const Occluders>(std::move(scene.occluders));
    const Vec3 origin = light_frame(scene.lights.empty() ? scene.light : scene.lights.front().light).origin;
    MaskTask task{.lights = {},
                  .receivers = std::make_shared<const Receivers>(std::move(scene.receivers)),
                  .geometry = Geometry(std::move(scene.objects), origin),
                  .technique = technique_from(scene.technique),
                  .output = scene.output,
                  .warnings = std::move(scene.warnings),
                  .cache = nullptr,
                  .receivers_key = {}};
    for (const std::size_t i : chosen_from(choosable(scene), choice)) {
        if (scene.lights.empty()) {
            task.lights.push_back({.name = {},
                                   .weight = 1,
                                   .place = 0,
                                   .own_occluders = false,
                                   .light = at_frame(scene.light, choice.frame),
                                   .occluders = shared,
                                   .key = {},
                                   .still_key = {}});
            continue;
        }
        SceneLight& light = scene.lights[i];
        task.lights.push_back({.name = light.name,
                               .weight = light.weight,
                               .place = i,
                               .own_occluders = light.occluders.has_value(),
                               .light = at_frame(light.light, choice.frame),
                               .occluders = light.occluders ? std::make_shared<const Occluders>(std::move(*light.occluders)) : shared,
                               .key = {},
                               .still_key = {}});
    }
    return task;
}

Prepared prepare(const Engine& engine, const MaskTask& task, const TaskLight& light, const Deadline& deadline)
{
    if (task.cache)
        if (const auto kept = task.cache->prepared(light.key)) return *kept;
    deadline.check("preparing");
    const auto still = task.cache ? task.cache->prepared(light.still_key) : std::nullopt;
    const Prepared prepared = still ? engine.with_emission(*still, *std::get<RectangleLight>(light.light).emission)
                                    : engine.prepare(light.light, *light.occluders, task.geometry, task.technique);
    if (task.cache) {
        task.cache->keep(light.still_key, prepared);
        task.cache->keep(light.key, prepared);
    }
    return prepared;
}

void prepare_all(const Engine& engine, const MaskTask& task, const Deadline& deadline)
{
    for_each_light(task, [&](const TaskLight& light) { prepare(engine, task, light, deadline); });
}

MaskReply compute_mask(const Engine& engine, const MaskTask& task, const MaskFormat& format, const Options& options,
                       const Deadline& deadline)
{
    check_work(task, options);
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

std::string etag_of(const Engine& engine, std::string_view content, const MaskChoice& choice, const MaskFormat& format)
{
    Digest digest;
    digest.add(content)
        .add(choice.light)
        .add(std::to_string(choice.frame))
        .add(format.format)
        .add(version())
        .add(engine.device().name)
        .add(engine.device().driver);
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
