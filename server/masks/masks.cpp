#include "masks/masks.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

#include <penumbra/error.hpp>
#include <penumbra/scene_file.hpp>

#include "masks/digest.hpp"
#include "masks/resources.hpp"
#include "masks/work_limits.hpp"
#include "process/problem.hpp"

namespace penumbra::server {
namespace {

// A stage's name as a token of Server-Timing.
std::string token_of(std::string_view name)
{
    std::string token;
    for (const char c : name) token += (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ? c : '-';
    return token;
}

std::string header_of(const ErrorEstimate& estimate)
{
    return nlohmann::ordered_json{{"mean", estimate.mean}, {"p99", estimate.p99}, {"pixels", estimate.pixels}, {"by", estimate.by}}.dump();
}

// How a mask of that scene, or its bound, is encoded in that format.
OutputFormat encoding_of(const MaskTask& task, const MaskFormat& format)
{
    if (task.job.bound) return {.format = std::string(format.format), .bits = 32, .channels = {"low", "high"}};
    const std::string_view wanted = task.output.format == "tiff" ? std::string_view("tif") : std::string_view(task.output.format);
    return {.format = std::string(format.format), .bits = wanted == format.format ? task.output.bits : 0};
}

// What a run of the task finds in its cache and leaves there.
class TaskKeeper : public MaskKeeper {
public:
    explicit TaskKeeper(const MaskTask& task) : task_(task) {}
    std::optional<Prepared> prepared(std::size_t light, int) override { return task_.cache->prepared(task_.light_keys[light].frame); }
    std::optional<Prepared> prepared_in_any_frame(std::size_t light) override
    {
        return task_.cache->prepared(task_.light_keys[light].still);
    }
    void keep(std::size_t light, int, const Prepared& prepared) override
    {
        task_.cache->keep(task_.light_keys[light].still, prepared);
        task_.cache->keep(task_.light_keys[light].frame, prepared);
    }
    std::shared_ptr<const Receivers> receivers() override { return task_.cache->receivers(task_.receivers_key); }
    void keep(std::shared_ptr<const Receivers> receivers) override { task_.cache->keep(task_.receivers_key, std::move(receivers)); }

private:
    const MaskTask& task_;
};

// Calls it with the hooks of a run of the task: its cache, and the deadline between steps.
template <class Call>
void with_hooks(const MaskTask& task, const Deadline& deadline, const std::function<void(const WorkAmount&)>& estimated, const Call& call)
{
    TaskKeeper keeper(task);
    call(MaskHooks{.keeper = task.cache ? &keeper : nullptr,
                   .before = [&](std::string_view next) { deadline.check(next); },
                   .estimated = estimated});
}

// The mask of all the task's lights together, which a run gives last.
Mask mask_of(const Engine& engine, const MaskTask& task, const Options& options, const Deadline& deadline)
{
    Mask last;
    with_hooks(task, deadline, estimate_check(task, options, deadline),
               [&](const MaskHooks& hooks) { engine.masks(task.job, hooks, [&](NamedMask&& named) { last = std::move(named.mask); }); });
    return last;
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
    return parse_scene(part->bytes, resources);
}

std::vector<std::size_t> chosen_from(const std::vector<MaskLight>& lights, const MaskChoice& choice)
{
    std::vector<Choosable> choosable;
    choosable.reserve(lights.size());
    for (const MaskLight& light : lights) choosable.push_back({light.name, static_cast<int>(frames_of(light.light))});
    return chosen_from(choosable, choice);
}

MaskLight at_choice(const MaskLight& light, const MaskChoice& choice)
{
    MaskLight now{.name = light.name,
                  .weight = light.weight,
                  .place = light.place,
                  .light = at_frame(light.light, choice.frame),
                  .occluders = light.occluders,
                  .own_occluders = light.own_occluders};
    return now;
}

MaskTask task_of(std::span<const Part> parts, const MaskChoice& choice, const Options& options, const Deadline& deadline)
{
    Scene scene = decode_scene(parts, options, deadline);
    const Technique technique = technique_from(scene.technique);
    const OutputFormat output = scene.output;
    MaskTask task{.job = job_of(std::move(scene), technique), .output = output};
    std::vector<MaskLight> chosen;
    for (const std::size_t i : chosen_from(task.job.lights, choice)) chosen.push_back(at_choice(task.job.lights[i], choice));
    task.job.lights = std::move(chosen);
    task.job.combined = task.job.lights.size() > 1;
    task.job.bound = choice.image == MaskImage::bound;
    task.job.error_estimate = choice.error_estimate;
    return task;
}

void prepare_all(const Engine& engine, const MaskTask& task, const Deadline& deadline)
{
    with_hooks(task, deadline, {}, [&](const MaskHooks& hooks) { engine.prepare(task.job, hooks); });
}

MaskReply compute_mask(const Engine& engine, const MaskTask& task, const MaskFormat& format, const Options& options,
                       const Deadline& deadline)
{
    check_work(task, options);
    MaskReply reply;
    const auto computing = Deadline::Clock::now();
    const Mask mask = mask_of(engine, task, options, deadline);
    reply.compute_ms = seconds_since(computing) * 1000;

    deadline.check("encoding the mask");
    const auto encoding = Deadline::Clock::now();
    const std::vector<std::byte> bytes = encode_image(task.job.bound ? mask.bound : mask.visibility, encoding_of(task, format));
    reply.bytes.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    reply.encode_ms = seconds_since(encoding) * 1000;

    reply.technique = mask.report.technique;
    reply.pixels = mask.visibility.pixel_count();
    reply.device_bytes = mask.report.peak_device_bytes;
    reply.warnings = mask.report.warnings;
    if (mask.report.error_estimate) reply.error_estimate = header_of(*mask.report.error_estimate);
    for (const Stage& stage : mask.report.stages) reply.stages.push_back({token_of(stage.name), stage.ms});
    reply.stages.push_back({"encode", reply.encode_ms});
    return reply;
}

std::string etag_of(std::string_view device, std::string_view content, const MaskChoice& choice, const MaskFormat& format)
{
    Digest digest;
    digest.add(content)
        .add(choice.light)
        .add(std::to_string(choice.frame))
        .add(choice.image == MaskImage::bound ? "bound" : "mask")
        .add(choice.error_estimate ? "error_estimate" : "")
        .add(format.format)
        .add(version())
        .add(device);
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
