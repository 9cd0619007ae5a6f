// Lights, objects, output, and the scene itself; cameras and depth images are in scene_description_views.cpp, encodings in
// scene_description_encoding.cpp.
#include "io/scene_description.hpp"

#include <array>

#include "scene/lights.hpp"

namespace penumbra::scene_file {
namespace {

Key center()
{
    return {.name = "center", .type = Numbers{3}, .meaning = "its middle", .unit = "length", .required = true, .example = "[0, 6, 0]"};
}

std::vector<Key> axes()
{
    return {{.name = "direction",
             .type = Numbers{3},
             .meaning = "where it shines; any length but 0",
             .fallback = "[0, -1, 0]",
             .example = "[0.25, -1, 0]"},
            {.name = "up",
             .type = Numbers{3},
             .meaning = "turns the light's image about its axis; not along `direction`",
             .otherwise = "`[0, 1, 0]`; `[0, 0, -1]` when `direction` is within 8 degrees of the Y axis",
             .example = "[0, 0, -1]"}};
}

std::vector<Key> with_axes(std::vector<Key> keys)
{
    for (Key& key : axes()) keys.push_back(std::move(key));
    return keys;
}

Form rectangle()
{
    constexpr std::string_view edges = "half-edge; the two are at a right angle (cosine at most 0.00001); both `[0, 0, 0]`: a point light";
    return {
        .name = "rectangle",
        .of = "of a rectangle",
        .meaning = "shines along normalize(cross(half_v, half_u))",
        .keys = {kind("rectangle"),
                 center(),
                 {.name = "half_u", .type = Numbers{3}, .meaning = edges, .unit = "length", .required = true, .example = "[0.5, 0, 0]"},
                 {.name = "half_v", .type = Numbers{3}, .meaning = edges, .unit = "length", .required = true, .example = "[0, 0, -0.5]"},
                 {.name = "emission",
                  .type = Files{1, max_frames, true},
                  .meaning = "an image over the rectangle, left to right along +u, top to bottom along -v; 1 or 3 channels, not negative, "
                             "not black. A list of images is a sequence, one a frame",
                  .otherwise = "uniform",
                  .example = "\"emission.exr\""}}};
}

std::vector<Form> light_forms()
{
    return {rectangle(),
            {.name = "sphere",
             .of = "of a sphere",
             .meaning = "counts as the disc of its radius that faces the receiver",
             .keys = with_axes({kind("sphere"),
                                center(),
                                {.name = "radius",
                                 .type = Number{.low = 0},
                                 .meaning = "0: a point light",
                                 .unit = "length",
                                 .required = true,
                                 .example = "0.5"}})},
            {.name = "point", .of = "of a point", .meaning = "no extent", .keys = with_axes({kind("point"), center()})},
            {.name = "directional",
             .of = "of a directional light",
             .meaning = "a disc of directions, from everywhere the same",
             .keys = with_axes({kind("directional"),
                                {.name = "angular_diameter_deg",
                                 .type = Number{.low = 0, .high = 179.9},
                                 .meaning = "the sun is 0.53",
                                 .unit = "degrees",
                                 .required = true,
                                 .example = "0.53"}})}};
}

// What a light has as one of several.
std::vector<Key> listed_keys()
{
    return {{.name = "name",
             .type = Text{"^[A-Za-z0-9_-]{1,64}$"},
             .meaning = "1 to 64 of A-Z a-z 0-9 _ -, no two alike; masks are named after it",
             .otherwise = "its place, from `\"1\"`",
             .example = "\"key\""},
            {.name = "weight",
             .type = Number{.low = 0},
             .meaning = "its power relative to the others, the same in every channel; not 0 for all of them",
             .fallback = "1",
             .example = "2"},
            {.name = "occluders",
             .type = One{occluders},
             .meaning = "depth images that were rendered from this light, or how to render them",
             .otherwise = "the scene's",
             .example = "{}"}};
}

// How an object is placed, and what it does.
std::vector<Key> placed(std::vector<Key> keys)
{
    const std::array<Key, 5> further{
        {{.name = "scale",
          .type = Number{.low = 0, .above_low = true},
          .meaning = "a factor, for all three axes",
          .fallback = "1",
          .example = "2"},
         {.name = "rotate_deg",
          .type = Numbers{3},
          .meaning = "about X, then Y, then Z; after `scale`",
          .unit = "degrees",
          .fallback = "[0, 0, 0]",
          .example = "[0, 30, 0]"},
         {.name = "translate",
          .type = Numbers{3},
          .meaning = "after `rotate_deg`",
          .unit = "length",
          .fallback = "[0, 0, 0]",
          .example = "[0, 1, 0]"},
         {.name = "casts", .type = Boolean{}, .meaning = "throws shadows", .fallback = "true", .example = "false"},
         {.name = "receives",
          .type = Boolean{},
          .meaning = "is shaded, where `receivers.depth` is rendered",
          .fallback = "true",
          .example = "false"}}};
    keys.insert(keys.end(), further.begin(), further.end());
    return keys;
}

} // namespace

const Object& light()
{
    static const Object object{"light", "What shines. `kind` decides the other keys.", light_forms()};
    return object;
}

const Object& listed_light()
{
    static const Object object = [] {
        Object listed{"listed_light", "One of several lights.", light_forms()};
        for (Form& form : listed.forms)
            for (Key& key : listed_keys()) form.keys.push_back(std::move(key));
        return listed;
    }();
    return object;
}

const Object& quad()
{
    constexpr std::string_view edge = "half-edge; not parallel to the other";
    static const Object object = of_one_form(
        "quad", "A parallelogram; its front faces where cross(half_u, half_v) points.",
        {{.name = "center", .type = Numbers{3}, .meaning = "the middle", .unit = "length", .required = true, .example = "[0, 0, 0]"},
         {.name = "half_u", .type = Numbers{3}, .meaning = edge, .unit = "length", .required = true, .example = "[4, 0, 0]"},
         {.name = "half_v", .type = Numbers{3}, .meaning = edge, .unit = "length", .required = true, .example = "[0, 0, -4]"}});
    return object;
}

const Object& object()
{
    static const Object object{
        "object",
        "A surface that casts, receives or both: of a mesh, a quad, or a depth image.",
        {{.name = "mesh",
          .of = "of a mesh",
          .meaning = "the triangles of a file",
          .keys = placed({{.name = "mesh",
                           .type = File{},
                           .meaning = "OBJ, PLY, STL, 3DS, glTF 2 (`.gltf`, `.glb`), decided by the extension",
                           .required = true,
                           .example = "\"bunny.obj\""},
                          {.name = "files",
                           .type = FileTable{},
                           .meaning = "where the files lie that the mesh names (`.bin`, `.mtl`, images), by its names for them",
                           .otherwise = "beside the mesh",
                           .example = R"({"my mesh.bin": "my_mesh.bin"})"},
                          {.name = "weld",
                           .type = Number{.low = 0},
                           .meaning = "vertices no further apart are joined, as loose triangles want it whose corners were rounded; 0: those at equal places",
                           .unit = "length",
                           .fallback = "0",
                           .example = "1e-6"}})},
         {.name = "quad",
          .of = "of a quad",
          .meaning = "a parallelogram",
          .keys = placed({{.name = "quad",
                           .type = One{quad},
                           .meaning = "a parallelogram",
                           .required = true,
                           .example = R"({"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]})"}})},
         {.name = "depth",
          .of = "of a depth object",
          .meaning = "the surfaces that one camera sees",
          .keys = placed({{.name = "depth",
                           .type = File{},
                           .meaning = "image of depth; its surfaces are fitted and traced in the image itself",
                           .otherwise = "`position`",
                           .example = "\"view.exr\""},
                          {.name = "position",
                           .type = File{},
                           .meaning = "image of world positions, in place of `depth`; three channels",
                           .otherwise = "`depth`",
                           .example = "\"position.exr\""},
                          {.name = "camera",
                           .type = One{camera},
                           .meaning = "the camera that saw it",
                           .required = true,
                           .example = R"({"kind": "pinhole", "eye": [0, 2, 5], "target": [0, 0, 0], "vertical_fov_deg": 40})"},
                          {.name = "encoding",
                           .type = One{encoding},
                           .meaning = "how the image stores depth",
                           .fallback = R"({"kind": "planar"})",
                           .example = R"({"kind": "radial"})"},
                          {.name = "thickness",
                           .type = LengthOrAuto{},
                           .meaning = "of the bodies behind the surfaces; `\"auto\"`: round or mirrored bodies, from their silhouettes",
                           .unit = "length",
                           .fallback = "\"auto\"",
                           .example = "0.2"}}),
          .exactly_one = {"depth", "position"}}}};
    return object;
}

const Object& output()
{
    static const Object object =
        of_one_form("output", "The mask's format, where a file name does not decide it.",
                    {{.name = "format",
                      .type = Text{"^([Ee][Xx][Rr]|[Tt][Ii][Ff][Ff]?|[Pp][Nn][Gg]|[Pp][Ff][Mm]|[Hh][Dd][Rr])$"},
                      .meaning = "`exr`, `tif`, `png`, `pfm` or `hdr`. `penumbra mask -o` goes by the file name; `penumbra batch` by this",
                      .required = true,
                      .example = "\"tif\""},
                     {.name = "bits",
                      .type = OneOfIntegers{{8, 16, 32}},
                      .meaning = "a sample's; exr 16 or 32, tif 8, 16 or 32, png 8 or 16, pfm and hdr 32",
                      .otherwise = "exr, tif, pfm and hdr 32, png 16",
                      .example = "32"}});
    return object;
}

const Object& scene()
{
    static const Object object =
        of_one_form("scene", "A light, what casts, what receives.",
                    {{.name = "penumbra", .type = Constant{1}, .meaning = "the version of the file", .required = true, .example = "1"},
                     {.name = "light",
                      .type = One{light},
                      .meaning = "the light",
                      .otherwise = "needed, or `lights`",
                      .example = R"({"kind": "point", "center": [0, 6, 0]})"},
                     {.name = "lights",
                      .type = List{listed_light, 1, max_lights},
                      .meaning = "several lights: a mask of each, and one of all together",
                      .otherwise = "needed, or `light`",
                      .example = R"([{"kind": "point", "center": [0, 6, 0], "name": "lamp"}])"},
                     {.name = "objects",
                      .type = List{scene_file::object, 0, any_number},
                      .meaning = "surfaces that cast, receive or both",
                      .fallback = "[]",
                      .example = R"([{"mesh": "bunny.obj"}])"},
                     {.name = "occluders",
                      .type = One{occluders},
                      .meaning = "depth seen from the light, or how to render it from `objects`",
                      .fallback = "{}",
                      .example = R"({"resolution": [512, 512]})"},
                     {.name = "receivers",
                      .type = One{receivers},
                      .meaning = "depth of what is shaded, or how to render it from `objects`",
                      .fallback = "{}",
                      .example = R"({"depth": "receiver.exr"})"},
                     {.name = "technique",
                      .type = TechniqueKeys{},
                      .meaning = "how the mask is computed",
                      .otherwise = "`soft_shadow_map`; where all that casts is depth objects, `depth_trace`",
                      .example = R"({"kind": "ray_traced"})"},
                     {.name = "output",
                      .type = One{output},
                      .meaning = "format of the mask",
                      .otherwise = "by the mask's file name",
                      .example = R"({"format": "exr"})"}},
                    {"light", "lights"});
    return object;
}

std::span<const Object* const> objects()
{
    static const std::array all{&scene(),          &light(),     &listed_light(), &object(),     &quad(),     &occluders(), &occluder_depth(),
                                &receivers(), &camera(),       &intrinsics(), &encoding(), &anchor(),    &output()};
    return all;
}

} // namespace penumbra::scene_file
