// Every scene of the suite by some settings and by rays: error and time in one row. suite_table.py makes the tables of times at equal error from it.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "cases.hpp"
#include "rows.hpp"
#include "suite_scenes.hpp"

namespace penumbra::bench {
namespace {

constexpr int side = 512, reference_samples = 4096;

// "texels@kind:key=value,key=value": the occluder maps' texels a side (512 without), and a technique.
int texels_of(const std::string& text) { return text.find('@') == std::string::npos ? side : std::stoi(text); }

Technique technique_of(const std::string& setting)
{
    const std::string text = setting.substr(setting.find('@') + 1);
    const std::size_t colon = text.find(':');
    TechniqueRequest request{.kind = text.substr(0, colon), .settings = {}};
    for (std::size_t at = colon; at != std::string::npos && at + 1 < text.size(); at = text.find(',', at + 1)) {
        const std::size_t equals = text.find('=', at), end = std::min(text.find(',', at + 1), text.size());
        if (equals == std::string::npos || equals > end) throw Error(ErrorCode::usage, "suite: \"" + text + "\"", "expected kind:key=value,key=value");
        const std::string key = text.substr(at + 1, equals - at - 1), value = text.substr(equals + 1, end - equals - 1);
        char* rest = nullptr;
        const long long whole = std::strtoll(value.c_str(), &rest, 10);
        const bool integer = *rest == 0;
        const double real = std::strtod(value.c_str(), &rest);
        if (value == "true" || value == "false")
            request.settings.emplace_back(key, value == "true");
        else if (integer)
            request.settings.emplace_back(key, static_cast<std::int64_t>(whole));
        else if (*rest == 0)
            request.settings.emplace_back(key, real);
        else
            request.settings.emplace_back(key, value);
    }
    return technique_from(request);
}

const std::vector<std::string> usual{
    "128@soft_shadow_map:preset=paper",
    "32@soft_shadow_map:layers=0,tolerance=0.25",
    "32@soft_shadow_map:layers=0,tolerance=0.12",
    "64@soft_shadow_map:layers=0,tolerance=0.25",
    "64@soft_shadow_map:layers=0,tolerance=0.12",
    "128@soft_shadow_map:layers=0,tolerance=0.25",
    "128@soft_shadow_map:layers=0,tolerance=0.12",
    "128@soft_shadow_map:layers=0,tolerance=0.06",
    "256@soft_shadow_map:layers=0,tolerance=0.12",
    "256@soft_shadow_map:layers=0,tolerance=0.06",
    "64@soft_shadow_map:tolerance=0.12",
    "128@soft_shadow_map:tolerance=0.12",
    "256@soft_shadow_map:tolerance=0.12",
    "256@soft_shadow_map:tolerance=0.06",
    "soft_shadow_map:resolution=64,layers=0,tolerance=0.25",
    "soft_shadow_map:resolution=128,layers=0,tolerance=0.12",
    "soft_shadow_map:resolution=256,layers=0,tolerance=0.06",
    "soft_shadow_map:layers=0,tolerance=0.12",
    "soft_shadow_map:layers=0,tolerance=0.06",
    "soft_shadow_map:layers=0",
    "soft_shadow_map:tolerance=0.12",
    "soft_shadow_map:tolerance=0.06",
    "soft_shadow_map:",
    "2048@soft_shadow_map:resolution=512,layers=0",
    "soft_shadow_volume:",
    "occlusion_texture:",
    "ray_traced:samples=64,tolerance=0.12",
    "ray_traced:samples=256,tolerance=0.06",
};
const std::vector<std::string> rival{"ray_traced:samples=16,adaptive=true,first_samples=4", "ray_traced:samples=32,adaptive=true,first_samples=8", "ray_traced:samples=64,adaptive=true",
                                     "ray_traced:samples=128,adaptive=true", "ray_traced:samples=256,adaptive=true", "ray_traced:samples=1024,adaptive=true"};

} // namespace

Image suite_reference(const Engine& engine, const SuiteScene& scene)
{
    const char* folder = std::getenv("PENUMBRA_BENCH_REFERENCES");
    const auto file = std::filesystem::path(folder ? folder : "") / (scene.name + "_" + std::to_string(side) + ".exr");
    if (folder && std::filesystem::exists(file)) return read_image(file);
    const Image reference = engine.mask(scene.scene, RayTraced{.samples = reference_samples, .adaptive = true, .first_samples = 64, .seed = 4711}).visibility;
    if (folder) write_image(file, reference);
    return reference;
}

std::vector<std::string>& suite_settings()
{
    static std::vector<std::string> settings;
    return settings;
}

void suite(const Engine& engine)
{
    const char* only = std::getenv("PENUMBRA_BENCH_SCENES"); // names, whatever stands between them
    std::vector<std::string> settings = suite_settings();
    if (settings.empty()) {
        settings = usual;
        settings.insert(settings.end(), rival.begin(), rival.end());
    }
    for (SuiteScene& one : suite_scenes(side, side)) {
        if (only && std::string(only).find(one.name) == std::string::npos) continue;
        const Image reference = suite_reference(engine, one);
        for (const std::string& text : settings) {
            const Technique technique = technique_of(text);
            one.scene.occluders.width = one.scene.occluders.height = texels_of(text);
            Row row = measure(engine, one.scene, technique, reference, text.starts_with("ray") ? 1 : 5);
            if (texels_of(text) != side) row.settings += " map=" + std::to_string(texels_of(text));
            row.bench = "suite";
            row.scene = one.name;
            row.parameter = row.share_shaded;
            print(row);
        }
    }
}

} // namespace penumbra::bench
