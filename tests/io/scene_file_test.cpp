#include <cmath>
#include <map>

#include "io/scene_support.hpp"
#include "scene/light_space.hpp"

using namespace penumbra;
using namespace penumbra::test;

TEST(SceneFile, ReadsTheContractsExample)
{
    MemoryResources resources = parts();
    resources.parts["occluder_front.exr"] = encode_image(constant(256, 256, 3), {"exr", 32});
    resources.parts["occluder_back.exr"] = encode_image(constant(256, 256, 3.5f), {"exr", 32});
    resources.parts["receiver.exr"] = encode_image(constant(512, 512, 6), {"exr", 32});
    const Scene scene = parse_scene(R"({
        "penumbra": 1,
        "light": { "kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5] },
        "objects": [
          { "quad": { "center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4] }, "casts": false, "receives": true } ],
        "occluders": { "camera": { "kind": "light", "tan_half_fov": [0.5, 0.5] }, "resolution": [256, 256],
          "depth": { "front": "occluder_front.exr", "back": "occluder_back.exr", "layers": [] }, "encoding": { "kind": "planar" } },
        "receivers": { "camera": { "kind": "light", "tan_half_fov": [0.5, 0.5] }, "resolution": [512, 512], "depth": "receiver.exr",
          "encoding": { "kind": "planar" } },
        "technique": { "kind": "soft_shadow_map", "sides": "both" },
        "output": { "format": "exr", "bits": 32 } })",
                                    resources);
    EXPECT_EQ(light_frame(scene.light).direction, Vec3(0, -1, 0));
    ASSERT_EQ(scene.objects.size(), 1u);
    EXPECT_FALSE(scene.objects[0].casts);
    EXPECT_TRUE(scene.objects[0].receives);
    ASSERT_TRUE(scene.occluders.front && scene.occluders.back && scene.receivers.depth);
    EXPECT_EQ(scene.occluders.front->at(3, 3), 3);
    EXPECT_EQ(scene.occluders.back->at(3, 3), 3.5f);
    EXPECT_EQ(scene.receivers.width, 512);
    EXPECT_EQ(std::get<LightCamera>(scene.occluders.camera).tan_half_fov, Vec2(0.5, 0.5));
    EXPECT_EQ(scene.technique.kind, "soft_shadow_map");
    EXPECT_EQ(scene.technique.settings.size(), 1u);
    EXPECT_EQ(scene.output.format, "exr");
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(SceneFile, ReadsEveryLight)
{
    EXPECT_EQ(std::get<SphereLight>(parse(scene_of(with_light(R"({"kind": "sphere", "center": [1, 2, 3], "radius": 0.5})"))).light).radius,
              0.5);
    EXPECT_EQ(std::get<PointLight>(
                  parse(scene_of(with_light(R"({"kind": "point", "center": [1, 2, 3], "direction": [1, 0, 0], "up": [0, 0, 1]})"))).light)
                  .up,
              Vec3(0, 0, 1));
    const auto directional =
        std::get<DirectionalLight>(parse(scene_of(with_light(R"({"kind": "directional", "angular_diameter_deg": 0.53})"))).light);
    EXPECT_EQ(directional.direction, Vec3(0, -1, 0));
    EXPECT_EQ(directional.angular_diameter_deg, 0.53);
    const Scene textured = parse(scene_of(
        with_light(R"({"kind": "rectangle", "center": [0, 6, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -1], "emission": "light.exr"})")));
    EXPECT_EQ(std::get<RectangleLight>(textured.light).emission->channels, 3);
}

TEST(SceneFile, ReadsEveryCamera)
{
    const auto camera = [&](const std::string& json) { return parse(scene_of(with_camera(json))).receivers.camera; };
    EXPECT_EQ(std::get<LightCamera>(camera(R"({"kind": "light", "tan_half_fov": 0.7})")).tan_half_fov, Vec2(0.7, 0.7));
    EXPECT_FALSE(std::get<LightCamera>(camera(R"({"kind": "light"})")).tan_half_fov);
    const auto look =
        std::get<PinholeCamera>(camera(R"({"kind": "pinhole", "eye": [0, 0, 5], "target": [0, 0, 0], "vertical_fov_deg": 90})"));
    EXPECT_EQ(look.frame.x, Vec3(1, 0, 0));
    EXPECT_EQ(look.frame.y, Vec3(0, 1, 0));
    EXPECT_EQ(look.frame.z, Vec3(0, 0, 1));
    EXPECT_EQ(look.frame.origin, Vec3(0, 0, 5));
    EXPECT_EQ(look.tan_half_fov.x, 0);
    EXPECT_NEAR(look.tan_half_fov.y, 1, 1e-15); // tan of a rounded pi / 4
    const auto matrix = std::get<PinholeCamera>(camera(
        R"({"kind": "pinhole", "world_from_camera": [0, 0, 1, 7, 1, 0, 0, 8, 0, 1, 0, 9, 0, 0, 0, 1], "tan_half_fov": [0.5, 0.25]})"));
    EXPECT_EQ(matrix.frame.origin, Vec3(7, 8, 9));
    EXPECT_EQ(matrix.frame.x, Vec3(0, 1, 0));
    EXPECT_EQ(matrix.frame.y, Vec3(0, 0, 1));
    EXPECT_EQ(matrix.frame.z, Vec3(1, 0, 0));

    const Scene directional = parse(scene_of(
        sun + R"(, "receivers": {"depth": "depth.exr", "camera": {"kind": "light", "half_extent": [3, 2], "center": [0, 9, 0]}})"));
    EXPECT_EQ(std::get<LightCamera>(directional.receivers.camera).half_extent, Vec2(3, 2));
    EXPECT_EQ(std::get<LightCamera>(directional.receivers.camera).center, Vec3(0, 9, 0));
}

TEST(SceneFile, MatricesOfFewDigitsBecomeRotations)
{
    const auto camera = std::get<PinholeCamera>(
        parse(
            scene_of(with_camera(
                R"({"kind": "pinhole", "world_from_camera": [0.70711, 0, 0.70711, 0, 0, 1, 0, 0, -0.70711, 0, 0.70711, 0, 0, 0, 0, 1], "tan_half_fov": 1})")))
            .receivers.camera);
    EXPECT_NEAR(camera.frame.x.length(), 1, 1e-15);
    EXPECT_NEAR(camera.frame.x.dot(camera.frame.z), 0, 1e-15);
    EXPECT_NEAR(camera.frame.z.x, std::sqrt(0.5), 1e-15);
}

TEST(SceneFile, ReadsEveryEncoding)
{
    const auto depth = [&](const std::string& name, const std::string& encoding) {
        return parse(scene_of(with_receivers(R"("camera": {"kind": "light", "tan_half_fov": [1, 1]}, "depth": ")" + name +
                                             R"(", "encoding": )" + encoding)))
            .receivers.depth->at(0, 0);
    };
    EXPECT_EQ(depth("depth.exr", R"({"kind": "planar", "scale": 0.5})"), 1);
    EXPECT_EQ(depth("depth.exr", R"({"kind": "disparity"})"), 0.5f);
    // The centre of pixel (0, 0) of 4 x 3 is at (-3/4, 2/3): distance 2 is depth 2 / sqrt(1 + 9/16 + 4/9), to float32.
    EXPECT_NEAR(depth("depth.exr", R"({"kind": "radial"})"), 2 / std::sqrt(1 + 9.0 / 16 + 4.0 / 9), 2 * 0x1p-24);
    // 0.5 is stored as 32768 of 65535.
    EXPECT_NEAR(depth("short.png", R"({"kind": "normalized", "near": 1, "far": 3})"), 1 + 2 * 32768.0 / 65535, 4 * 0x1p-24);
    EXPECT_NEAR(depth("short.png", R"({"kind": "window", "near": 1, "far": 3})"), 1 / (1 + 32768.0 / 65535 * (1.0 / 3 - 1)), 4 * 0x1p-24);
    EXPECT_NEAR(depth("short.png", R"({"kind": "reversed_window", "near": 1, "far": 3})"), 1 / (1.0 / 3 + 32768.0 / 65535 * (1 - 1.0 / 3)),
                4 * 0x1p-24);
    EXPECT_EQ(depth("depth.exr", R"({"kind": "planar", "empty": 2, "channel": "Y"})"), nothing_there);
}

TEST(SceneFile, PlacesObjects)
{
    const auto corners = [&](const std::string& members) {
        return parse(scene_of(with_object(R"({"quad": {"center": [1, 0, 0], "half_u": [1, 0, 0], "half_v": [0, 1, 0]})" + members + "}")))
            .objects[0]
            .mesh;
    };
    const TriangleMesh plain = corners("");
    EXPECT_EQ(plain.positions, (std::vector<Imath::V3f>{{0, -1, 0}, {2, -1, 0}, {2, 1, 0}, {0, 1, 0}}));
    for (const auto& [a, b, c] : plain.triangles)
        EXPECT_GT((plain.positions[b] - plain.positions[a]).cross(plain.positions[c] - plain.positions[a]).z, 0)
            << "faces cross(half_u, half_v)";

    // (2, 1, 0), scaled by 2: (4, 2, 0); about X by 90 degrees: (4, 0, 2); about Y: (2, 0, -4); about Z: (0, 2, -4); moved by (10, 20, 30).
    const Imath::V3f moved = corners(R"(, "scale": 2, "rotate_deg": [90, 90, 90], "translate": [10, 20, 30])").positions[2];
    // Cosines of a rounded right angle are 6e-17, times coordinates of at most 4: nothing in float32 beside 10 and more.
    EXPECT_EQ(moved, Imath::V3f(10, 22, 26));
}

TEST(SceneFile, DepthImagesBecomeObjects)
{
    const Scene scene = parse(scene_of(with_object(
        R"({"depth": "depth.exr", "camera": {"kind": "pinhole", "eye": [0, 0, 5], "target": [0, 0, 0], "vertical_fov_deg": 60}, "translate": [0, 0, 1]})")));
    ASSERT_EQ(scene.objects.size(), 1u);
    ASSERT_TRUE(scene.objects[0].seen);
    const SeenSurface& seen = *scene.objects[0].seen;
    EXPECT_TRUE(seen.depth.from_image);
    EXPECT_EQ(seen.depth.depth, std::vector<float>(12, 2)) << "4 x 3 pixels at depth 2";
    EXPECT_EQ(seen.camera.frame.origin, Vec3(0, 0, 6)) << "the camera at z = 5, moved by 1";
    EXPECT_EQ(seen.thickness, 0) << "auto";
    EXPECT_EQ(parse(scene_of(with_object(R"({"depth": "empty.exr", "camera": {"kind": "light", "tan_half_fov": 1}})"))).warnings.size(),
              1u);
}

TEST(SceneFile, ResolutionsComeFromImages)
{
    const Scene scene =
        parse(scene_of(rectangle + R"(, "occluders": {"depth": {"front": "depth.exr"}}, "receivers": {"depth": "wide.exr"})"));
    EXPECT_EQ(scene.occluders.width, 4);
    EXPECT_EQ(scene.occluders.height, 3);
    EXPECT_EQ(scene.receivers.width, 5);
    const Scene plain = parse(scene_of(rectangle + ", " + quad));
    EXPECT_EQ(plain.occluders.width, 256);
    EXPECT_EQ(plain.receivers.height, 512);
}

TEST(SceneFile, WarnsOfFewBits)
{
    EXPECT_EQ(parse(scene_of(with_receivers(R"("depth": "half.exr")"))).warnings.size(), 1u);
    const Scene shallow =
        parse(scene_of(with_receivers(R"("depth": "byte.png", "encoding": {"kind": "normalized", "near": 1, "far": 2})")));
    ASSERT_EQ(shallow.warnings.size(), 1u);
    EXPECT_EQ(shallow.warnings[0].rfind("receivers.depth: byte.png", 0), 0u) << shallow.warnings[0];
}

TEST(SceneFile, LoadsBesideItsImages)
{
    const Folder folder;
    write_image(folder / "depth.exr", constant(4, 3, 2));
    folder.write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::string path =
        folder.write("scene.json", scene_of(rectangle + R"(, "receivers": {"depth": "depth.exr"}, "objects": [{"mesh": "one.obj"}])"));
    const Scene scene = load_scene(path);
    EXPECT_EQ(scene.receivers.depth->at(0, 0), 2);
    EXPECT_EQ(scene.objects[0].mesh.triangles.size(), 1u);
    EXPECT_EQ(scene.objects[0].name, "one.obj");

    EXPECT_EQ(error_of([&] { load_scene(folder / "none.json"); }).code(), ErrorCode::not_found);
    const std::string lost = folder.write("lost.json", scene_of(rectangle + R"(, "receivers": {"depth": "lost.exr"})"));
    const Error error = error_of([&] { load_scene(lost); });
    EXPECT_EQ(error.code(), ErrorCode::not_found);
    EXPECT_EQ(error.place(), lost);
    EXPECT_EQ(error.path(), "receivers.depth");
    EXPECT_EQ(error.message(), "lost.exr: no such file");
    EXPECT_EQ(std::string(error.what()).rfind(lost + ": receivers.depth: lost.exr", 0), 0u) << error.what();
}

namespace {

void expect_same(const CameraSpec& a, const CameraSpec& b, int width, int height)
{
    ASSERT_EQ(a.index(), b.index());
    if (const auto* light = std::get_if<LightCamera>(&a)) {
        EXPECT_EQ(light->tan_half_fov, std::get<LightCamera>(b).tan_half_fov);
        EXPECT_EQ(light->half_extent, std::get<LightCamera>(b).half_extent);
        EXPECT_EQ(light->center, std::get<LightCamera>(b).center);
        return;
    }
    const auto &first = std::get<PinholeCamera>(a), &second = std::get<PinholeCamera>(b);
    EXPECT_EQ(first.frame.origin, second.frame.origin);
    EXPECT_EQ(first.frame.x, second.frame.x);
    EXPECT_EQ(first.frame.y, second.frame.y);
    EXPECT_EQ(first.frame.z, second.frame.z);
    EXPECT_EQ(second.tan_half_fov,
              Vec2(first.tan_half_fov.x != 0 ? first.tan_half_fov.x : first.tan_half_fov.y * width / height, first.tan_half_fov.y));
}

} // namespace

TEST(SceneFile, WhatIsWrittenReadsBackEqual)
{
    const std::string cameras =
        R"(, "occluders": {"depth": {"front": "depth.exr", "layers": ["depth.exr", "depth.exr"]}, "camera": {"kind": "light", "tan_half_fov": [0.3, 0.1]}},
        "receivers": {"depth": "wide.exr", "camera": {"kind": "pinhole", "eye": [0.1, 2, 5], "target": [0.3, 0.7, 0], "vertical_fov_deg": 47}},
        "technique": {"kind": "soft_shadow_map", "sides": "front", "bias": 1.5, "resolution": 128}, "output": {"format": "png", "bits": 16})";
    const std::string sun_cameras =
        R"(, "receivers": {"depth": "wide.exr", "camera": {"kind": "light", "half_extent": [0.3, 0.1], "center": [1, 2, 0.7]}})";
    for (const std::string& members :
         {rectangle + cameras, point + cameras, sun + sun_cameras,
          R"("light": {"kind": "sphere", "center": [0, 6, 0.1], "radius": 0.7, "direction": [0.1, -1, 0], "up": [0, 0, 1]})" + cameras,
          R"("light": {"kind": "rectangle", "center": [0, 6, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -1], "emission": "light.exr"})" +
              cameras}) {
        SCOPED_TRACE(members);
        const Scene scene = parse(scene_of(members));
        DepthNames names;
        names.front = scene.occluders.front ? "depth.exr" : "";
        names.receiver = "wide.exr";
        names.emission = "light.exr";
        names.layers.resize(scene.occluders.layers.size(), "depth.exr");
        const std::string text = write_scene(scene, names);
        const Scene back = parse(text);

        EXPECT_EQ(write_scene(back, names), text);
        ASSERT_EQ(back.light.index(), scene.light.index());
        const LightFrame a = light_frame(scene.light), b = light_frame(back.light);
        EXPECT_EQ(a.origin, b.origin);
        EXPECT_EQ(a.u, b.u);
        EXPECT_EQ(a.v, b.v);
        EXPECT_EQ(a.direction, b.direction);
        EXPECT_EQ(a.half_u, b.half_u);
        EXPECT_EQ(a.half_v, b.half_v);
        expect_same(scene.occluders.camera, back.occluders.camera, scene.occluders.width, scene.occluders.height);
        expect_same(scene.receivers.camera, back.receivers.camera, scene.receivers.width, scene.receivers.height);
        EXPECT_EQ(back.occluders.width, scene.occluders.width);
        EXPECT_EQ(back.receivers.height, scene.receivers.height);
        EXPECT_EQ(back.occluders.layers.size(), scene.occluders.layers.size());
        EXPECT_EQ(back.receivers.depth->depth, scene.receivers.depth->depth);
        EXPECT_EQ(back.technique.kind, scene.technique.kind);
        std::map<std::string, SettingValue> before(scene.technique.settings.begin(), scene.technique.settings.end());
        EXPECT_EQ((std::map<std::string, SettingValue>(back.technique.settings.begin(), back.technique.settings.end())), before);
        EXPECT_EQ(back.output.format, scene.output.format);
        EXPECT_EQ(back.output.bits, scene.output.bits);
    }
}

TEST(SceneFile, WritingNeedsNamesForWhatThereIs)
{
    const Scene textured = parse(scene_of(
        with_light(R"({"kind": "rectangle", "center": [0, 6, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -1], "emission": "light.exr"})")));
    EXPECT_EQ(error_of([&] { write_scene(textured, {}); }).code(), ErrorCode::usage);
    const Scene layered = parse(scene_of(with_occluders(R"("depth": {"layers": ["depth.exr"]})")));
    EXPECT_EQ(error_of([&] { write_scene(layered, {}); }).code(), ErrorCode::usage);
}
