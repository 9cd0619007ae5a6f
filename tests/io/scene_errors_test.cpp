#include "io/scene_support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

struct Wrong {
    std::string members;
    std::string key; // that the message starts with, or has in it
    std::string other = "";
    bool whole = false; // `members` is the whole text
};

void expect_errors(const std::vector<Wrong>& cases)
{
    for (const Wrong& wrong : cases) {
        SCOPED_TRACE(wrong.members);
        const Error error = error_of([&] { parse(wrong.whole ? wrong.members : scene_of(wrong.members)); });
        EXPECT_EQ(exit_code(error.code()), 2) << error.what();
        EXPECT_MENTIONS(error, wrong.key);
        EXPECT_MENTIONS(error, wrong.other);
    }
}

} // namespace

TEST(SceneErrors, Json)
{
    expect_errors({
        {"", "is not JSON", "line 1", true},
        {"{", "is not JSON", "column", true},
        {"{\"penumbra\": 1,\n \"light\": }", "line 2, column 11", "", true},
        {"[]", "expected an object", "", true},
        {"1", "expected an object", "", true},
        {"\xff\xfe", "is not JSON", "", true},
        {std::string("{}\0{}", 5), "is not JSON", "byte 3 is 0", true},
        {std::string("{\"penumbra\": 1}\0", 16), "is not JSON", "byte 16 is 0", true},
        {rectangle + ", " + quad + ", " + rectangle, "\"light\" stands twice"},
        {R"("light": {"kind": "point", "center": [0, 1, 0], "center": [0, 2, 0]}, )" + quad, "\"center\" stands twice"},
        {std::string(100, '['), "nested deeper than 32", "", true},
        {R"("light": {"kind": "point", "center": [0, 1e999, 0]}, )" + quad, "1e999"},
    });
}

TEST(SceneErrors, TopLevel)
{
    expect_errors({
        {"{}", "penumbra: is missing", "", true},
        {R"({"penumbra": 2})", "penumbra: is 2", "1", true},
        {R"({"penumbra": "1"})", "penumbra:", "expected 1", true},
        {R"({"penumbra": 1.0})", "penumbra:", "", true},
        {quad, "light: is missing"},
        {rectangle, "nothing in it"},
        {rectangle + R"(, "objects": [])", "nothing in it"},
        {rectangle + ", " + quad + R"(, "lamps": [])", "lamps: is an unknown key", "known: penumbra, light, lights, objects"},
        {rectangle + R"(, "objects": {})", "objects: is an object", "expected an array"},
        {rectangle + ", " + quad + R"(, "output": {"format": "jpg"})", "output: unknown image format", "exr, tif"},
        {rectangle + ", " + quad + R"(, "output": {"format": "png", "bits": 32})", "output: 32 bits"},
        {rectangle + ", " + quad + R"(, "output": {"format": "png", "bits": 64})", "output.bits: is 64"},
        {rectangle + ", " + quad + R"(, "output": {"bits": 8})", "output.format: is missing"},
        {rectangle + ", " + quad + R"(, "output": {"format": "png", "quality": 1})", "output.quality"},
        {rectangle + ", " + quad + R"(, "technique": {})", "technique.kind: is missing"},
        {rectangle + ", " + quad + R"(, "technique": {"kind": "magic"})", "technique", "soft_shadow_map"},
        {rectangle + ", " + quad + R"(, "technique": {"kind": "soft_shadow_map", "side": "both"})", "technique.side", "sides"},
        {rectangle + ", " + quad + R"(, "technique": {"kind": "soft_shadow_map", "sides": "up"})", "technique.sides"},
        {rectangle + ", " + quad + R"(, "technique": {"kind": "soft_shadow_map", "sides": []})", "technique.sides: is an array"},
        {rectangle + ", " + quad + R"(, "technique": {"kind": "soft_shadow_map", "sides": null})", "technique.sides: is null"},
        {rectangle + ", " + quad + R"(, "technique": {"kind": "ray_traced", "samples": 18446744073709551615})", "technique.samples"},
    });
}

TEST(SceneErrors, Lights)
{
    expect_errors({
        {with_light("1"), "light: is 1", "expected an object"},
        {with_light("{}"), "light.kind: is missing"},
        {with_light(R"({"kind": "area"})"), "light.kind: is \"area\"", "rectangle, sphere, point, directional"},
        {with_light(R"({"kind": "rectangle", "half_u": [1, 0, 0], "half_v": [0, 0, 1]})"), "light.center: is missing"},
        {with_light(R"({"kind": "rectangle", "center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [1, 0, 1]})"), "light.half_v",
         "orthogonal"},
        {with_light(R"({"kind": "rectangle", "center": [0, 0, 0], "half_u": [1, 0], "half_v": [1, 0, 1]})"),
         "light.half_u: is an array of 2"},
        {with_light(R"({"kind": "rectangle", "center": [0, "a", 0], "half_u": [1, 0, 0], "half_v": [0, 0, 1]})"),
         "light.center[1]: is the string"},
        {with_light(R"({"kind": "rectangle", "center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 0, 1], "radius": 1})"), "light.radius",
         "half_u"},
        {with_light(R"({"kind": "sphere", "center": [0, 0, 0]})"), "light.radius: is missing"},
        {with_light(R"({"kind": "sphere", "center": [0, 0, 0], "radius": -1})"), "light.radius"},
        {with_light(R"({"kind": "point", "center": [0, 0, 0], "direction": [0, 0, 0]})"), "light.direction"},
        {with_light(R"({"kind": "point", "center": [0, 0, 0], "up": [0, 1, 0]})"), "light.up", "parallel"},
        {with_light(R"({"kind": "directional"})"), "light.angular_diameter_deg: is missing"},
        {with_light(R"({"kind": "directional", "angular_diameter_deg": 180})"), "light.angular_diameter_deg"},
        {with_light(R"({"kind": "directional", "angular_diameter_deg": 1, "center": [0, 0, 0]})"), "light.center", "angular_diameter_deg"},
    });
    for (const auto& [name, part] : {std::pair{"alpha.exr", "4 channels"},
                                     {"black.exr", "black"},
                                     {"negative.exr", "-1"},
                                     {"none.exr", "none.exr"},
                                     {"broken.exr", "broken.exr is not an image"}})
        expect_errors(
            {{with_light(R"({"kind": "rectangle", "center": [0, 6, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -1], "emission": ")" +
                         std::string(name) + "\"}"),
              "light.emission", part}});
}

TEST(SceneErrors, Objects)
{
    expect_errors({
        {with_object("1"), "objects[0]: is 1"},
        {with_object("{}"), "objects[0]: has 0 of mesh, quad, depth and position"},
        {with_object(R"({"mesh": "a.obj", "quad": {}})"), "objects[0]: has 2 of"},
        {with_object(R"({"mesh": 1})"), "objects[0].mesh: is 1", "expected a string"},
        {with_object(R"({"mesh": "a.obj"})"), "objects[0].mesh: a.obj"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0]}})"), "objects[0].quad.half_v: is missing"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [2, 0, 0]}})"), "objects[0].quad: has no area"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 0, 0]}})"), "objects[0].quad: has no area"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0], "size": 1}})"), "objects[0].quad.size"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0]}, "scale": [1, 2, 3]})"),
         "objects[0].scale: is an array"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0]}, "scale": 0})"), "objects[0].scale: is 0"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0]}, "scale": 1e300})"),
         "objects[0].scale: is 1e+300", "up to 1e+12"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0]}, "rotate": [1, 2, 3]})"),
         "objects[0].rotate", "rotate_deg"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0]}, "casts": 1})"), "objects[0].casts: is 1",
         "true or false"},
        {with_object(R"({"quad": {"center": [0, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0]}, "encoding": {}})"),
         "objects[0].encoding"},
        {with_object(R"({"depth": "depth.exr"})"), "objects[0].camera: is missing"},
        {with_object(R"({"depth": "depth.exr", "camera": {"kind": "light"}})"), "objects[0].camera.tan_half_fov"},
        {with_object(R"({"depth": "none.exr", "camera": {"kind": "light", "tan_half_fov": 1}})"), "objects[0].depth: none.exr"},
    });
}

TEST(SceneErrors, DepthImages)
{
    expect_errors({
        {with_receivers(R"("depth": "none.exr")"), "receivers.depth: none.exr"},
        {with_receivers(R"("depth": "broken.exr")"), "receivers.depth: broken.exr is not an image"},
        {with_receivers(R"("depth": {"front": "depth.exr"})"), "receivers.depth: is an object", "expected a string"},
        {with_receivers(R"("depth": "")"), "receivers.depth"},
        {with_receivers(R"("depth": "a\u0000b")"), "receivers.depth", "control"},
        {with_receivers(R"("depth": "a\nb")"), "receivers.depth", "control"},
        {with_receivers(R"("depth": "byte.png")"), "receivers.depth: byte.png is 8-bit", "normalized"},
        {with_receivers(R"("depth": "light.exr")"), "receivers.depth: light.exr", "R, G, B"},
        {with_receivers(R"("depth": "depth.exr", "resolution": [4, 4])"), "receivers.depth: depth.exr is 4 x 3, expected 4 x 4",
         "receivers.resolution"},
        {with_receivers(R"("depth": "depth.exr", "resolution": [4])"), "receivers.resolution"},
        {with_receivers(R"("depth": "depth.exr", "resolution": [4.5, 3])"), "receivers.resolution[0]"},
        {with_receivers(R"("depth": "depth.exr", "resolution": [0, 3])"), "receivers.resolution[0]", "1 to 65536"},
        {with_receivers(R"("depth": "depth.exr", "resolution": [4, 65537])"), "receivers.resolution[1]", "1 to 65536"},
        {with_receivers(R"("depths": "depth.exr")"), "receivers.depths", "known: camera, resolution, depth, position, encoding"},
        {with_occluders(R"("depth": "depth.exr")"), "occluders.depth", "front, back, layers"},
        {with_occluders(R"("depth": {"top": "depth.exr"})"), "occluders.depth.top", "front, back, layers"},
        {with_occluders(R"("depth": {"front": "depth.exr", "back": "wide.exr"})"), "occluders.depth.back: wide.exr is 5 x 3",
         "occluders.depth.front"},
        {with_occluders(R"("depth": {"front": "depth.exr", "layers": ["depth.exr", "wide.exr"]})"), "occluders.depth.layers[1]: wide.exr"},
        {with_occluders(R"("depth": {"layers": "depth.exr"})"), "occluders.depth.layers", "an array"},
    });
    MemoryResources small = parts();
    small.limit = 11;
    const Error error = error_of([&] { parse_scene(scene_of(with_receivers(R"("depth": "depth.exr")")), small); });
    EXPECT_EQ(error.code(), ErrorCode::too_large);
    EXPECT_MENTIONS(error, "receivers.depth: depth.exr");
}

TEST(SceneErrors, Encodings)
{
    const auto with = [](const std::string& encoding) { return with_receivers("\"depth\": \"depth.exr\", \"encoding\": " + encoding); };
    expect_errors({
        {with(R"("planar")"), "receivers.encoding"},
        {with(R"({"kind": "linear"})"), "receivers.encoding.kind: is \"linear\"",
         "planar, radial, disparity, window, reversed_window, normalized"},
        {with(R"({"kind": "planar", "near": 1})"), "receivers.encoding.near", "of planar depth"},
        {with(R"({"kind": "window"})"), "receivers.encoding.near: is missing"},
        {with(R"({"near": 1})"), "receivers.encoding.near", "of planar depth"},
        {with(R"({"kind": "window", "near": 2, "far": 1})"), "receivers.depth: depth.exr", "near"},
        {with(R"({"kind": "normalized", "near": 2, "far": 2})"), "receivers.depth: depth.exr", "differ"},
        {with(R"({"part": -1})"), "receivers.encoding.part"},
        {with(R"({"part": 1.5})"), "receivers.encoding.part"},
        {with(R"({"part": 1})"), "receivers.depth: depth.exr has no part 1"},
        {with(R"({"part": "depth"})"), "receivers.depth: depth.exr has no part \"depth\""},
        {with(R"({"kind": "disparity", "anchors": []})"), "receivers.encoding.anchors"},
        {with(R"({"kind": "disparity", "anchors": [{"pixel": [0, 0], "depth": 1}]})"), "receivers.encoding.anchors"},
        {with(R"({"kind": "disparity", "anchors": [{"pixel": [0, 0], "depth": 1}, {"pixel": [0, 1], "depth": 0}]})"),
         "receivers.encoding.anchors[1].depth"},
        {with(R"({"kind": "disparity", "scale": 1, "anchors": [{"pixel": [0, 0], "depth": 1}, {"pixel": [0, 1], "depth": 2}]})"),
         "receivers.encoding.anchors", "beside scale"},
        {with(R"({"kind": "disparity", "anchors": [{"pixel": [0, 0], "depth": 1}, {"pixel": [4, 1], "depth": 2}]})"), "receivers.depth: depth.exr",
         "[4, 1]"},
        {with(R"({"kind": "disparity", "anchors": [{"pixel": [0, 0], "depth": 1}, {"pixel": [3, 2], "depth": 2}]})"), "receivers.depth: depth.exr",
         "same value"},
        {with(R"({"kind": "planar", "scale": 0})"), "receivers.encoding.scale"},
        {with(R"({"kind": "planar", "scale": "m"})"), "receivers.encoding.scale"},
        {with(R"({"kind": "planar", "empty": null})"), "receivers.encoding.empty"},
        {with(R"({"kind": "planar", "channel": "Q"})"), "receivers.depth: depth.exr has no channel \"Q\""},
        {with(R"({"kind": "radial"})"), "receivers.depth: depth.exr is radial", "tan_half_fov"},
        {sun + R"(, "receivers": {"camera": {"kind": "light", "half_extent": 1}, "depth": "depth.exr", "encoding": {"kind": "radial"}})",
         "orthographic"},
    });
}

TEST(SceneErrors, Cameras)
{
    expect_errors({
        {with_camera("{}"), "receivers.camera.kind: is missing"},
        {with_camera(R"({"kind": "fisheye"})"), "receivers.camera.kind", "light, pinhole"},
        {with_camera(R"({"kind": "light", "tan_half_fov": [1, 0]})"), "receivers.camera.tan_half_fov[1]"},
        {with_camera(R"({"kind": "light", "tan_half_fov": [1]})"), "receivers.camera.tan_half_fov"},
        {with_camera(R"({"kind": "light", "tan_half_fov": -1})"), "receivers.camera.tan_half_fov"},
        {with_camera(R"({"kind": "light", "half_extent": [1, 1]})"), "receivers.camera.half_extent", "directional"},
        {with_camera(R"({"kind": "light", "eye": [1, 1, 1]})"), "receivers.camera.eye"},
        {sun + R"(, "receivers": {"depth": "depth.exr", "camera": {"kind": "light", "tan_half_fov": 1}})", "receivers.camera.tan_half_fov",
         "half_extent"},
        {with_camera(R"({"kind": "pinhole"})"), "receivers.camera: is a pinhole without"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, 1]})"), "receivers.camera.vertical_fov_deg: is missing"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, 1], "vertical_fov_deg": 60, "intrinsics": {"fx": 1, "fy": 1, "cx": 1, "cy": 1}})"),
         "receivers.camera.intrinsics: stands beside vertical_fov_deg"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, 1], "intrinsics": {"fx": 1, "fy": 0, "cx": 1, "cy": 1}})"),
         "receivers.camera.intrinsics.fy"},
        {with_camera(R"({"kind": "light", "shift": [0, 0]})"), "receivers.camera.shift"},
        {with_receivers(R"("position": "light.exr")"), "receivers.position: light.exr holds positions", "pinhole"},
        {with_receivers(R"("position": "light.exr", "depth": "depth.exr")"), "receivers.position: stands beside depth"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 0], "target": [0, 0, 0], "vertical_fov_deg": 60})"),
         "receivers.camera.target: is where eye is"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 5, 0], "target": [0, 0, 0], "vertical_fov_deg": 60})"), "receivers.camera",
         "parallel"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 0, 2], "vertical_fov_deg": 60})"),
         "receivers.camera.up", "parallel"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 0, 0], "vertical_fov_deg": 60})"),
         "receivers.camera.up"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 5], "target": [0, 0, 0]})"), "receivers.camera.vertical_fov_deg: is missing"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 5], "target": [0, 0, 0], "vertical_fov_deg": 180})"),
         "receivers.camera.vertical_fov_deg", "180"},
        {with_camera(R"({"kind": "pinhole", "eye": [0, 0, 5], "target": [0, 0, 0], "vertical_fov_deg": 0})"),
         "receivers.camera.vertical_fov_deg"},
        {with_camera(R"({"kind": "pinhole", "eye": [1e308, 0, 5], "target": [-1e308, 0, 0], "vertical_fov_deg": 60})"), "receivers.camera"},
        {with_camera(R"({"kind": "pinhole", "world_from_camera": [1, 0, 0], "tan_half_fov": 1})"), "receivers.camera.world_from_camera"},
        {with_camera(R"({"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]})"),
         "receivers.camera.tan_half_fov: is missing"},
        {with_camera(R"({"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1], "tan_half_fov": 1})"),
         "receivers.camera.world_from_camera", "3, 7 and 11"},
        {with_camera(R"({"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1], "tan_half_fov": 1})"),
         "receivers.camera.world_from_camera"},
        {with_camera(R"({"kind": "pinhole", "world_from_camera": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1], "tan_half_fov": 1})"),
         "receivers.camera.world_from_camera"},
        {with_camera(
             R"({"kind": "pinhole", "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "tan_half_fov": 1, "eye": [0, 0, 0]})"),
         "receivers.camera.eye"},
    });
}
