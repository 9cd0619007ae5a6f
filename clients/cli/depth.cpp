// penumbra depth: the depth images that a scene needs, and a scene that refers to them instead of objects.
#include <filesystem>
#include <memory>

#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>
#include <penumbra/image.hpp>
#include <penumbra/scene.hpp>

#include "files.hpp"
#include <penumbra/scene_file.hpp>
#include "mask_files.hpp"
#include "progress.hpp"
#include "streams.hpp"
#include "technique/techniques.hpp"
#include "technique_flags.hpp"
#include "verbs.hpp"

namespace penumbra::cli {
namespace {

namespace fs = std::filesystem;

struct Flags {
    std::string scene, folder;
    TechniqueFlags technique;
};

constexpr const char* notes = R"(
Writes DIR/front.exr, back.exr, layer_1.exr ..., receiver.exr: those that the technique needs and those that the scene has, as planar depth in
scene units, float32, +infinity where nothing is; emission.exr for a textured light, emission.0001.exr ... for a sequence; of several lights
front.NAME.exr and so on for each; and DIR/scene.json, which refers to them and gives the same masks. DIR is made when it is not there. What is in it under these names is replaced.

Example:
  penumbra depth scene.json --out depth && penumbra mask depth/scene.json -o mask.exr)";

void write_depth(const fs::path& path, const DepthMap& map)
{
    write_image(path.string(), Image{map.width, map.height, 1, map.depth}, {"exr", 32});
}

// Writes the images of one light that are there and returns their names, which have `.<light>` in them for one of several.
LightNames write_light_images(const Light& light, const Occluders& occluders, const std::string& of, const fs::path& folder)
{
    const auto named = [&](const std::string& stem, int frame = 0) { return mask_file(stem + ".exr", of, frame); };
    const auto write = [&](const std::string& stem, const DepthMap& map) {
        write_depth(folder / named(stem), map);
        return named(stem);
    };
    LightNames names;
    if (occluders.front) names.front = write("front", *occluders.front);
    if (occluders.back) names.back = write("back", *occluders.back);
    for (const DepthMap& layer : occluders.layers) names.layers.push_back(write("layer_" + std::to_string(names.layers.size() + 1), layer));
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    if (!rectangle) return names;
    if (rectangle->emission) {
        names.emission = named("emission");
        write_image((folder / names.emission).string(), *rectangle->emission, {"exr", 32});
    }
    for (const Image& frame : rectangle->frames) {
        names.frames.push_back(named("emission", static_cast<int>(names.frames.size() + 1)));
        write_image((folder / names.frames.back()).string(), frame, {"exr", 32});
    }
    return names;
}

// Writes the images that are there and returns their names.
DepthNames write_images(const Scene& scene, const fs::path& folder)
{
    DepthNames names;
    if (scene.lights.empty()) static_cast<LightNames&>(names) = write_light_images(scene.light, scene.occluders, {}, folder);
    for (const SceneLight& light : scene.lights)
        names.lights.push_back(write_light_images(light.light, *light.occluders, light.name, folder));
    if (scene.receivers.depth) {
        names.receiver = "receiver.exr";
        write_depth(folder / names.receiver, *scene.receivers.depth);
    }
    return names;
}

int run(const Flags& flags)
{
    const fs::path folder = flags.folder;
    const fs::path scene_folder = fs::path(flags.scene).has_parent_path() ? fs::path(flags.scene).parent_path() : fs::path(".");
    if (fs::exists(folder)) require_different(flags.folder, "--out", scene_folder.string(), "the scene's folder");

    Progress progress;
    progress.step("reading " + flags.scene);
    Scene scene = read_scene(flags.scene);
    scene.technique = in_scene(flags.scene, [&] { return apply(scene.technique, flags.technique); });
    const Technique technique = technique_from(scene.technique);
    if (needs_of(technique).casters == Needs::Casters::required)
        throw Error(ErrorCode::usage, flags.scene + ": " + kind_of(technique) + " works on objects, not on depth images",
                    "choose another with --technique");

    progress.step("rendering depth");
    const Scene complete = in_scene(flags.scene, [&] { return with_depth(scene, technique); });

    // The scene comes last: it never refers to what is not there.
    progress.step("writing " + flags.folder);
    make_folder(flags.folder, "--out");
    const DepthNames names = write_images(complete, folder);
    write_text((folder / "scene.json").string(), write_scene(complete, names));
    progress.end();
    print_warnings(complete.warnings);
    return 0;
}

} // namespace

Verb depth_verb(CLI::App& program)
{
    const auto flags = std::make_shared<Flags>();
    CLI::App* app = add_verb(program, "depth", "Render the depth images that a scene needs.", "depth SCENE.json --out DIR [options]");
    app->add_option("SCENE.json", flags->scene, "the scene")->option_text(" ")->required();
    app->add_option("--out", flags->folder, "the folder to write into")->option_text("DIR")->required();
    add_technique_flags(*app, flags->technique);
    app->footer(notes);
    return {app, [flags] { return run(*flags); }};
}

} // namespace penumbra::cli
