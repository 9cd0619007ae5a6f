// Cameras whose axis meets the image beside its middle: their masks are those of the image that reaches around it.
#include "support/maps.hpp"

#include "scene/camera.hpp"
#include "technique/table.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

// The whole image, and the part of it that an off-axis camera sees.
constexpr int width = 96, height = 72, left = 40, top = 12, part_width = 48, part_height = 56;

PinholeCamera whole_camera()
{
    const Vec3 back = Vec3(1, 3, 5).normalized(), right = Vec3(0, 1, 0).cross(back).normalized();
    return {.frame = {.origin = Vec3(1, 3, 5), .x = right, .y = back.cross(right), .z = back}, .tan_half_fov = {.4, .3}};
}

PinholeCamera part_camera()
{
    const PinholeCamera whole = whole_camera();
    const Camera part = part_of_view(pinhole_view(whole, width, height), width, height, left, top, part_width, part_height);
    return {.frame = whole.frame, .tan_half_fov = part.half_extent, .shift = part.off_axis / part.half_extent / 2.};
}

Object quad(const Vec3& center, const Vec3& u, const Vec3& v)
{
    Object object{.name = "quad", .mesh = {}};
    for (const Vec3& p : {center - u - v, center + u - v, center + u + v, center - u + v}) object.mesh.positions.emplace_back(p);
    object.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return object;
}

// A plate over a floor.
Scene scene_with(const PinholeCamera& camera, int columns, int rows)
{
    Object floor = quad({0, 0, 0}, {6, 0, 0}, {0, 0, -6});
    floor.casts = false;
    return {.light = RectangleLight{.center = {-1, 4, 1}, .half_u = {.5, 0, 0}, .half_v = {0, 0, -.5}, .emission = {}},
            .objects = {quad({.3, .6, 0}, {.6, 0, 0}, {0, 0, -.5}), floor},
            .occluders = {.camera = LightCamera{}, .width = 128, .height = 128, .front = {}, .back = {}, .layers = {}},
            .receivers = {.camera = camera, .width = columns, .height = rows, .depth = {}},
            .technique = {},
            .output = {},
            .warnings = {}};
}

Scene whole_scene() { return scene_with(whole_camera(), width, height); }
Scene part_scene() { return scene_with(part_camera(), part_width, part_height); }

// The part of an image, of one sample a pixel.
std::vector<float> part_of(const std::vector<float>& whole)
{
    std::vector<float> part;
    for (int y = 0; y < part_height; ++y)
        for (int x = 0; x < part_width; ++x) part.push_back(whole[static_cast<std::size_t>((y + top) * width + x + left)]);
    return part;
}

// The image of the part's pixels alone, in the size of the whole.
DepthMap around(const DepthMap& part)
{
    return map_of(width, height, [&](int x, int y) {
        const bool inside = x >= left && x < left + part_width && y >= top && y < top + part_height;
        return inside ? part.at(x - left, y - top) : nothing_there;
    });
}

double mean_difference(const std::vector<float>& a, const std::vector<float>& b)
{
    EXPECT_EQ(a.size(), b.size());
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
    return sum / static_cast<double>(a.size());
}

double mean(const std::vector<float>& values)
{
    double sum = 0;
    for (const float value : values) sum += value;
    return sum / static_cast<double>(values.size());
}

DepthMap rendered(const Scene& scene) { return *with_depth(scene.receivers, scene.light, Geometry(scene.objects)).depth; }

std::vector<float> mask_of(Scene scene, const std::string& kind)
{
    scene.technique.kind = kind;
    return engine().mask(scene, technique_from(scene.technique)).visibility.pixels;
}

} // namespace

TEST(OffAxis, RenderedDepthIsThePart)
{
    const std::vector<float> part = rendered(part_scene()).depth, expected = part_of(rendered(whole_scene()).depth);
    for (std::size_t i = 0; i < part.size(); ++i) EXPECT_NEAR(part[i], expected[i], 1e-5f * expected[i]) << i;
}

// Receivers rendered from meshes, by every technique.
TEST(OffAxis, MasksOfMeshesAreThePart)
{
    for (const TechniqueRow& row : technique_table()) {
        SCOPED_TRACE(row.kind);
        const std::vector<float> part = mask_of(part_scene(), std::string(row.kind)),
                                 whole = part_of(mask_of(whole_scene(), std::string(row.kind)));
        EXPECT_LT(mean(whole), .97) << "there is a shadow to compare";
        EXPECT_LT(mean_difference(part, whole), .002);
    }
}

// Receivers from a depth image, which is fitted: a little else near the border.
TEST(OffAxis, MasksOfDepthImagesAreThePart)
{
    const auto shaded = [](Scene scene, const std::string& kind) {
        scene.receivers.depth = rendered(scene);
        scene.receivers.depth->from_image = true;
        return mask_of(std::move(scene), kind);
    };
    for (const TechniqueRow& row : technique_table()) {
        SCOPED_TRACE(row.kind);
        const std::string kind(row.kind);
        EXPECT_LT(mean_difference(shaded(part_scene(), kind), part_of(shaded(whole_scene(), kind))), .01);
    }
}

// All there is is the depth image: it casts and receives, seen through either camera.
TEST(OffAxis, DepthObjectsCastTheSameShadow)
{
    DepthMap image = rendered(part_scene());
    image.from_image = true;
    const auto relit = [](Scene scene, DepthMap depth, const std::string& kind) {
        depth.from_image = true;
        const Camera camera = pinhole_view(std::get<PinholeCamera>(scene.receivers.camera), depth.width, depth.height);
        scene.receivers.depth = depth;
        scene.objects = {Object{.name = "image", .mesh = {}, .seen = SeenSurface{.depth = std::move(depth), .camera = camera}}};
        return mask_of(std::move(scene), kind);
    };
    for (const std::string kind : {"depth_trace", "ray_traced", "soft_shadow_map"}) {
        SCOPED_TRACE(kind);
        const std::vector<float> part = relit(part_scene(), image, kind), whole = part_of(relit(whole_scene(), around(image), kind));
        EXPECT_LT(mean(whole), .97);
        EXPECT_LT(mean_difference(part, whole), .01);
    }
}

// The light's own map has its axis in the middle: another pinhole is refused.
TEST(OffAxis, OccludersAreSeenAlongTheAxis)
{
    Scene scene = part_scene();
    scene.light = RectangleLight{.center = {0, 4, 0}, .half_u = {.5, 0, 0}, .half_v = {0, 0, -.5}, .emission = {}};
    PinholeCamera own{.frame = {.origin = {0, 4, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}}, .tan_half_fov = {.5, .5}};
    scene.occluders.camera = own;
    EXPECT_NO_THROW(mask_of(scene, "soft_shadow_map"));
    own.shift = {.1, 0};
    scene.occluders.camera = own;
    try {
        mask_of(scene, "soft_shadow_map");
        ADD_FAILURE() << "nothing was thrown";
    } catch (const Error& error) {
        EXPECT_EQ(error.path(), "occluders.camera");
    }
}

} // namespace penumbra::test
