// A patch of a kept scene: the merge by itself, on three documents; then what a task makes of it.
#include <algorithm>
#include <array>
#include <chrono>

#include "fuzz/samples.hpp"
#include "fuzz/target.hpp"
#include "io/json_value.hpp"
#include "masks/kept_scene.hpp"
#include "process/problem.hpp"

using namespace penumbra;
using namespace penumbra::server;
using fuzz::expect;
using Json = nlohmann::json;

namespace {

constexpr std::array documents{
    R"({"penumbra": 1, "light": {"kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5]},
        "occluders": {"camera": {"kind": "light", "tan_half_fov": [0.5, 0.5]}, "depth": {"front": "depth.exr"}},
        "receivers": {"camera": {"kind": "light", "tan_half_fov": [0.5, 0.5]}, "depth": "depth.exr"},
        "technique": {"kind": "soft_shadow_map", "sides": "both"}, "output": {"format": "exr", "bits": 32}})",
    R"({"penumbra": 1, "light": {"kind": "directional", "angular_diameter_deg": 0.53},
        "objects": [{"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}}],
        "receivers": {"camera": {"kind": "pinhole", "eye": [0, 1, 5], "target": [0, 0, 0], "vertical_fov_deg": 60}, "resolution": [8, 8]},
        "technique": {"kind": "ray_traced"}})",
    R"({"penumbra": 1, "light": {"kind": "sphere", "center": [0, 6, 0], "radius": 1},
        "objects": [{"depth": "depth.exr", "camera": {"kind": "light", "tan_half_fov": [0.5, 0.5]}}], "technique": {"kind": "ray_traced"}})",
    R"({"penumbra": 1, "lights": [{"kind": "sphere", "center": [0, 6, 0], "radius": 1, "name": "lamp"},
        {"kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5], "weight": 2,
         "emission": ["light.exr", "light.exr"], "occluders": {"resolution": [8, 8]}}],
        "objects": [{"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}}],
        "receivers": {"camera": {"kind": "pinhole", "eye": [0, 1, 5], "target": [0, 0, 0], "vertical_fov_deg": 60}, "resolution": [8, 8]},
        "technique": {"kind": "ray_traced"}})",
};

bool mentions_kind(const Json& json)
{
    if (json.is_object() && json.contains("kind")) return true;
    return json.is_structured() && std::ranges::any_of(json, mentions_kind);
}

void check_merge(const std::string& text, const Json& patch)
{
    const Json document = Json::parse(text);
    const SceneDocument once = SceneDocument(text).patched(patch.dump());
    const Json result = Json::parse(once.text());
    expect(once.patched(patch.dump()).text() == once.text(), "a patch changes more the second time");
    for (const auto& [key, value] : document.items())
        if (!patch.contains(key))
            expect(result.contains(key) && result[key] == value, "a section changes that is not in the patch: " + key);
    // Where no kind is in play the merge is RFC 7396's, which the JSON library has as well.
    if (mentions_kind(patch)) return;
    Json merged = document;
    merged.merge_patch(patch);
    expect(merged == result, "not what RFC 7396 says: " + result.dump());
}

const Options& options()
{
    static const Options small = [] {
        Options result;
        result.image_samples = static_cast<std::int64_t>(fuzz::max_samples);
        return result;
    }();
    return small;
}

std::vector<Part> image_parts()
{
    std::vector<Part> parts;
    for (const auto& [name, bytes] : fuzz::sample_images())
        parts.push_back({name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}});
    return parts;
}

const std::vector<std::unique_ptr<KeptScene>>& kept_scenes()
{
    static const auto scenes = [] {
        std::vector<std::unique_ptr<KeptScene>> result;
        for (const char* document : documents) {
            std::vector<Part> parts = image_parts();
            parts.push_back({"scene", document});
            result.push_back(std::make_unique<KeptScene>("id", parts, options(), Deadline(std::chrono::hours(1))));
        }
        return result;
    }();
    return scenes;
}

void check_task(const KeptScene& scene, std::string_view patch, std::span<const Part> extra)
{
    const MaskTask task = scene.task(patch, extra, scene.first_choice(), options(), Deadline(std::chrono::hours(1)));
    expect(!task.job.lights.empty() && task.job.receivers, "a task without lights or receivers");
    for (const MaskLight& light : task.job.lights) expect(light.occluders != nullptr, "a light without occluders");
    if (const auto& depth = task.job.receivers->depth)
        expect(depth->width == task.job.receivers->width && depth->height == task.job.receivers->height,
               "receivers of another size than their depth");
    for (const std::string& warning : task.job.warnings) fuzz::expect_message(warning);
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string_view text = fuzz::text_of(data, size);
    fuzz::accepted([&] {
        const Json patch = parse_json(text);
        for (const char* document : documents) check_merge(document, patch);
    });
    const std::vector<Part> images = image_parts();
    for (const auto& scene : kept_scenes())
        for (const std::span<const Part> extra : {std::span<const Part>(), std::span(images)}) {
            try {
                fuzz::accepted([&] { check_task(*scene, text, extra); });
            } catch (const Problem& problem) {
                fuzz::expect_message(problem.detail);
            }
        }
    return 0;
}
