// A scene's JSON, with small sound images behind the names in samples.hpp.
#include "fuzz/samples.hpp"
#include "fuzz/target.hpp"
#include <penumbra/scene_file.hpp>

using namespace penumbra;
using fuzz::expect;

namespace {

class Images : public Resources {
public:
    Bytes bytes(const std::string& name) const override
    {
        if (const auto found = written.find(name); found != written.end()) return Bytes(std::span(found->second));
        const auto found = fuzz::sample_images().find(name);
        if (found == fuzz::sample_images().end()) throw Error(ErrorCode::not_found, "no such part");
        return Bytes(std::span(found->second));
    }
    std::string path(const std::string&) const override { throw Error(ErrorCode::unsupported, "no meshes here"); }
    std::uint64_t max_samples() const override { return fuzz::max_samples; }

    std::map<std::string, std::vector<std::byte>> written;
};

void expect_size(const std::optional<DepthMap>& map, int width, int height)
{
    if (!map) return;
    expect(map->width == width && map->height == height, "a depth map of another size than its section");
    expect(map->depth.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
           "a depth map of another size than it claims");
    for (const float depth : map->depth) expect(depth > 0, "a depth that is not above 0");
}

void check_occluders(const Occluders& occluders)
{
    expect_size(occluders.front, occluders.width, occluders.height);
    expect_size(occluders.back, occluders.width, occluders.height);
    for (const DepthMap& layer : occluders.layers) expect_size(layer, occluders.width, occluders.height);
}

void check_scene(const Scene& scene)
{
    check_occluders(scene.occluders);
    for (const SceneLight& light : scene.lights)
        if (light.occluders) check_occluders(*light.occluders);
    fuzz::accepted([&] { only_frame(scene, frame_count(scene)); });
    for (const SceneLight& light : scene.lights) only_light(scene, light.name);
    expect_size(scene.receivers.depth, scene.receivers.width, scene.receivers.height);
    for (const std::string& warning : scene.warnings) fuzz::expect_message(warning);
    for (const Object& object : scene.objects)
        for (const auto& triangle : object.mesh.triangles)
            for (const std::uint32_t corner : triangle) expect(corner < object.mesh.positions.size(), "a triangle with a corner elsewhere");
}

// The names of a light's images, which are put among those of `images` with `prefix`.
LightNames named(const Light& light, const Occluders& occluders, const std::string& prefix, Images& images)
{
    LightNames names;
    const auto keep = [&](const std::string& name, const DepthMap& map) {
        images.written[prefix + name] = encode_depth(map);
        return prefix + name;
    };
    if (occluders.front) names.front = keep("front", *occluders.front);
    if (occluders.back) names.back = keep("back", *occluders.back);
    for (const DepthMap& layer : occluders.layers) names.layers.push_back(keep("layer" + std::to_string(names.layers.size()), layer));
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    if (!rectangle) return names;
    const auto keep_emission = [&](const std::string& name, const Image& image) {
        images.written[prefix + name] = encode_image(image, {"exr", 32});
        return prefix + name;
    };
    if (rectangle->emission) names.emission = keep_emission("emission", *rectangle->emission);
    for (const Image& frame : rectangle->frames)
        names.frames.push_back(keep_emission("frame" + std::to_string(names.frames.size()), frame));
    return names;
}

// The scene as a file, its images among those of `images`.
std::string written(const Scene& scene, Images& images)
{
    DepthNames names;
    static_cast<LightNames&>(names) = named(scene.light, scene.occluders, {}, images);
    for (const SceneLight& light : scene.lights)
        names.lights.push_back(named(light.light, light.occluders.value_or(Occluders{}), light.name + ".", images));
    if (scene.receivers.depth) {
        names.receiver = "receiver";
        images.written[names.receiver] = encode_depth(*scene.receivers.depth);
    }
    return write_scene(scene, names);
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    Images images;
    Scene scene;
    if (!fuzz::accepted([&] { scene = parse_scene(fuzz::text_of(data, size), images); })) return 0;
    check_scene(scene);

    // Objects are not written; without depth images there would be nothing in the file. Neither are sizes of 0, of maps that are not there.
    const bool occluders = scene.occluders.front || scene.occluders.back || !scene.occluders.layers.empty();
    if (!occluders || !scene.receivers.depth) return 0;
    const std::string file = written(scene, images);
    Scene again;
    std::string complaint;
    try {
        again = parse_scene(file, images);
    } catch (const Error& error) {
        fuzz::fail(std::string("a scene that was written is refused: ") + error.what() + "\n" + file);
    }
    expect(written(again, images) == file, "a scene that was read and written differs: " + file);
    return 0;
}
