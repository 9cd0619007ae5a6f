// A scene: a light, what casts, what receives. Plain data; knows no file format and no device.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <penumbra/export.hpp>
#include <penumbra/image.hpp>

namespace penumbra {

using Vec2 = Imath::V2d;
using Vec3 = Imath::V3d;

// --- Lights (lengths in scene units) -----------------------------------------------------------------------------------------

// Shines along normalize(cross(half_v, half_u)). `emission`, when given, lies over the rectangle, left to right along +half_u, top to
// bottom along -half_v; 1 or 3 channels, not negative, not all zero. `frames` instead is a sequence of such images, all of as many
// channels: a fire, a film. Engine::masks computes a mask for each.
struct RectangleLight {
    Vec3 center{0, 0, 0};
    Vec3 half_u{0, 0, 0}; // orthogonal half-edges
    Vec3 half_v{0, 0, 0};
    std::optional<Image> emission;
    std::vector<Image> frames = {};
};

// Counts as the disc of its radius that faces the receiver.
struct SphereLight {
    Vec3 center{0, 0, 0};
    double radius = 0;
    Vec3 direction{0, -1, 0};
    std::optional<Vec3> up;
};

struct PointLight {
    Vec3 center{0, 0, 0};
    Vec3 direction{0, -1, 0};
    std::optional<Vec3> up;
};

// A disc of directions of this angular diameter around `direction` (the sun: 0.53 degrees).
struct DirectionalLight {
    Vec3 direction{0, -1, 0};
    double angular_diameter_deg = 0;
    std::optional<Vec3> up;
};

using Light = std::variant<RectangleLight, SphereLight, PointLight, DirectionalLight>;

// --- Depth -------------------------------------------------------------------------------------------------------------------

constexpr float nothing_there = std::numeric_limits<float>::infinity();

// How far apart neighbouring stored numbers of a depth image are; 0: no such step.
struct DepthStep {
    double depth = 0;      // in depth, the same everywhere: integers that count depth
    double disparity = 0;  // in 1/depth, the same everywhere: integers of a depth buffer, of stereo
    int mantissa_bits = 0; // floating point with so many bits after the point, of depth / unit: 10 for half floats
    double unit = 1;
};

struct FineDepth;

// Planar depth (distance along the viewing axis, positive, scene units), row 0 at the top; `nothing_there` where there is nothing.
struct DepthMap {
    int width = 0;
    int height = 0;
    std::vector<float> depth;
    double precision = 0x1p-24; // largest relative rounding error of a depth: of float32, or of what it was decoded from
    // From an image that somebody else may have made: each pixel's surface is fitted before it is used (docs/depth.md), with what is known of
    // the image's own error. Else depth is exact: of the surface through each pixel's centre, right to `precision`, as an Engine renders it.
    bool from_image = false;
    double noise = 0; // standard error of a depth over the depth; 0: estimated from the image
    DepthStep step = {};
    // What an Engine saw of the texels' parts where it rendered this map (with_depth). Who changes the depth clears it.
    std::shared_ptr<const FineDepth> fine = {};

    float& at(int x, int y) { return depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
    float at(int x, int y) const
    {
        return depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
    }
};

// --- Cameras -----------------------------------------------------------------------------------------------------------------

// A rigid frame in world space: x right, y up, z backwards (a camera looks along -z). Orthonormal and right-handed.
struct Frame {
    Vec3 origin{0, 0, 0};
    Vec3 x{1, 0, 0};
    Vec3 y{0, 1, 0};
    Vec3 z{0, 0, 1};
};

// A camera that is ready to use.
struct Camera {
    Frame frame;
    bool orthographic = false;
    Vec2 half_extent{1, 1}; // perspective: tangents of the half angles; orthographic: half the width and height in scene units
    Vec2 off_axis{0, 0};    // from the viewing axis to the image's middle, right and up; in the same measure
};

// The light's own camera: at its centre, along its axis, image x along +u, image up along +v. What is left out is fitted to the
// objects that cast and receive (fit_camera).
struct LightCamera {
    std::optional<Vec2> tan_half_fov; // every light but a directional one
    std::optional<Vec2> half_extent;  // directional lights: orthographic
    std::optional<Vec3> center;       // directional lights: where the image plane's centre is; depth counts from there
};

// Focal lengths and principal point in pixels; (0, 0) is the image's top left corner, (0.5, 0.5) the first pixel's centre.
struct Intrinsics {
    double fx = 0, fy = 0, cx = 0, cy = 0;
};

// Any other camera. `tan_half_fov.x` of 0: from y, the image's aspect ratio and that of its pixels.
struct PinholeCamera {
    Frame frame;
    Vec2 tan_half_fov{0, 0};
    std::optional<Intrinsics> intrinsics = {}; // in place of tan_half_fov
    Vec2 shift{0, 0};                          // of the image, right and up, in its widths and heights
    double pixel_aspect = 1;                   // a pixel's width over its height
};

using CameraSpec = std::variant<LightCamera, PinholeCamera>;

struct DepthSurface; // of an Engine
struct SurfaceNormals;

// --- What casts and what receives ----------------------------------------------------------------------------------------------

// An image of how much of a surface is there: where it shows less than `cutoff`, nothing is. Looked up bilinearly between the texels' middles.
struct CutOut {
    enum class Beyond { repeat, mirror, clamp }; // what is seen outside of the image
    Image alpha;                                 // 1 channel
    float cutoff = 0.5f;
    Beyond beyond_u = Beyond::repeat, beyond_v = Beyond::repeat;
    bool nearest = false; // the nearest texel instead
};

// What of a mesh's triangles is cut out (leaves, fences). Rays and rendered depth go through; techniques that work on the mesh's own edges take
// the triangles as whole.
struct CutOuts {
    static constexpr std::uint32_t none = 0xffffffff;
    std::vector<CutOut> images;
    std::vector<std::uint32_t> image;                  // of each triangle: one of `images`, or none
    std::vector<std::array<Imath::V2f, 3>> texture;    // of each triangle's corners: (0, 0) is the image's top left, (1, 1) its bottom right
};

// Triangles in world space; three indices a triangle, counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<Imath::V3f> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::shared_ptr<const CutOuts> cut_outs = {}; // empty: nothing is cut out
};

// The surfaces that one camera sees: its depth image, fitted and traced in the image itself (docs/depth.md).
struct SeenSurface {
    DepthMap depth;
    Camera camera;
    double thickness = 0; // of the bodies behind the surfaces, scene units; 0: guessed from their silhouettes
};

struct Object {
    std::string name;
    TriangleMesh mesh;
    bool casts = true;
    bool receives = true;
    std::optional<SeenSurface> seen = {}; // in place of the mesh
};

// Depth of what casts shadows, seen from the light. What a technique needs and is not given is rendered from the objects that cast.
struct Occluders {
    CameraSpec camera = LightCamera{};
    int width = 256, height = 256;
    std::optional<DepthMap> front; // nearest surfaces
    std::optional<DepthMap> back;  // furthest back-facing surfaces
    std::vector<DepthMap> layers;  // further surfaces behind `front`, in order of depth
};

// Depth of what is shaded, from the light or from any other camera. The mask has its resolution and viewpoint.
struct Receivers {
    CameraSpec camera = LightCamera{};
    int width = 512, height = 512;
    std::optional<DepthMap> depth;
    // What was fitted to a depth image that somebody else may have made: an Engine makes it where it is missing.
    std::shared_ptr<const DepthSurface> surface = {};
    // The normals of what an Engine rendered `depth` from (with_depth). Who changes the depth clears them.
    std::shared_ptr<const SurfaceNormals> normals = {};
};

// --- The scene -----------------------------------------------------------------------------------------------------------------

using SettingValue = std::variant<bool, std::int64_t, double, std::string>;

// A technique by name, with the settings that differ from its defaults. technique_from (technique.hpp) makes the typed struct.
struct TechniqueRequest {
    std::string kind = "soft_shadow_map";
    std::vector<std::pair<std::string, SettingValue>> settings;
};

// One of several lights. The mask of all together is the mean of theirs by weight.
struct SceneLight {
    std::string name;  // 1 to 64 of A-Z a-z 0-9 _ -, no two alike
    double weight = 1; // its power relative to the others, in every channel; 0 or more
    Light light;
    std::optional<Occluders> occluders = {}; // seen from this light; without them the scene's
};

struct Scene {
    Light light;
    std::vector<SceneLight> lights = {}; // when there are any, `light` is not looked at; receivers need a camera of their own
    std::vector<Object> objects;
    Occluders occluders;
    Receivers receivers;
    TechniqueRequest technique;
    OutputFormat output;
    std::vector<std::string> warnings; // what was assumed or looks wrong; copied into the report
};

// Reads a scene file (JSON, version 1) and every image and mesh that it names, relative to the file.
// Throws Error naming file and key: not_found, invalid_input, too_large.
PENUMBRA_API Scene load_scene(const std::string& path);

constexpr std::size_t max_frames = 4096; // of a sequence
constexpr std::size_t max_lights = 256;  // of a scene

// How many frames the light's sequence has; 0: it has none.
PENUMBRA_API std::size_t frames_of(const Light& light);

// The light as it shines in that frame, counted from 1: without its sequence, which is not copied.
PENUMBRA_API Light at_frame(const Light& light, int frame);

// How many frames the scene's sequence has; 0 when no light has one.
PENUMBRA_API int frame_count(const Scene& scene);

// The scene with the light of that name alone, under `light`, and what it lights. Throws usage when there is none, listing those there are.
PENUMBRA_API Scene only_light(Scene scene, std::string_view name);

// The scene as it is in that frame, counted from 1, without a sequence. Throws usage for a frame that there is not.
PENUMBRA_API Scene only_frame(Scene scene, int frame);

} // namespace penumbra
