// What the engine refuses, and that the message says what, where and what was expected.
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

const SoftShadowMap front{.sides = Sides::front};

Error prepare_error(const Light& light, const Occluders& o, const Technique& technique)
{
    return error_of([&] { engine().prepare(light, o, technique); });
}

void expect_error(const Error& error, ErrorCode code, const std::vector<std::string>& parts)
{
    EXPECT_EQ(error.code(), code) << error.what();
    for (const std::string& part : parts) EXPECT_TRUE(holds(error.what(), part)) << "\"" << part << "\" is not in: " << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
}

TEST(EngineErrors, SizesThatDoNotFit)
{
    Occluders o = occluders(light_view(), flat(8, 8, 2));
    o.width = 9;
    expect_error(prepare_error(rectangle_light(1, 1), o, front), ErrorCode::invalid_input, {"occluders.depth.front", "8 x 8", "9 x 8"});
    o = occluders(light_view(), flat(8, 8, 2));
    o.front->depth.pop_back();
    expect_error(prepare_error(rectangle_light(1, 1), o, front), ErrorCode::invalid_input, {"occluders.depth.front", "63"});
    o = occluders(light_view(), flat(8, 8, 2));
    o.back = flat(8, 4, 2);
    expect_error(prepare_error(rectangle_light(1, 1), o, SoftShadowMap{}), ErrorCode::invalid_input, {"occluders.depth.back", "8 x 4"});
    o = occluders(light_view(), DepthMap{});
    expect_error(prepare_error(rectangle_light(1, 1), o, front), ErrorCode::invalid_input, {"occluders"});

    const Prepared prepared = engine().prepare(rectangle_light(1, 1), occluders(light_view(), flat(8, 8, 2)), front);
    Receivers r = receivers(light_view(), flat(8, 8, 4));
    r.height = 7;
    expect_error(error_of([&] { engine().shade(prepared, r); }), ErrorCode::invalid_input, {"receivers.depth", "8 x 8", "8 x 7"});
    r.depth.reset();
    expect_error(error_of([&] { engine().shade(prepared, r); }), ErrorCode::invalid_input, {"receivers.depth: is missing"});
}

// 65536 x 65536 would take 16 GiB a map, and its pixels would not count in a kernel's int: refused before anything is rendered.
TEST(EngineErrors, MapsOfMorePixelsThanAnyMapMayHave)
{
    TriangleMesh triangle{.positions = {{-1, -1, -2}, {1, -1, -2}, {0, 1, -2}}, .triangles = {{0, 1, 2}}};
    Scene scene;
    scene.light = rectangle_light(1, 1);
    scene.objects = {Object{.name = "triangle", .mesh = triangle}};
    scene.occluders.camera = scene.receivers.camera = light_view();
    scene.receivers.width = scene.receivers.height = 65536;
    for (const Technique& technique : {Technique(front), Technique(ShadowMap{}), Technique(RayTraced{})})
        expect_error(error_of([&] { engine().mask(scene, technique); }), ErrorCode::too_large,
                     {"receivers.resolution", "65536 x 65536", "1073741824"});
    scene.occluders.width = scene.occluders.height = 65536;
    expect_error(error_of([&] { engine().prepare(scene, front); }), ErrorCode::too_large, {"occluders.resolution"});

    const Prepared prepared = engine().prepare(rectangle_light(1, 1), occluders(light_view(), flat(8, 8, 2)),
                                               SoftShadowMap{.sides = Sides::front, .project = true, .project_resolution = 65536});
    expect_error(error_of([&] { engine().shade(prepared, receivers(light_view(), flat(8, 8, 4))); }), ErrorCode::too_large,
                 {"technique.project_resolution"});
}

TEST(EngineErrors, MissingMapsAreNamed)
{
    const Occluders o = occluders(light_view(), flat(8, 8, 2));
    expect_error(prepare_error(rectangle_light(1, 1), o, SoftShadowMap{.sides = Sides::both}), ErrorCode::invalid_input,
                 {"occluders.depth.back: is missing", "sides"});
    Occluders none = o;
    none.front.reset();
    for (const Technique& technique : {Technique(front), Technique(ShadowMap{})})
        expect_error(prepare_error(rectangle_light(1, 1), none, technique), ErrorCode::invalid_input,
                     {"occluders.depth.front: is missing"});

    // In a scene, objects would do.
    Scene scene{
        .light = rectangle_light(1, 1), .objects = {}, .occluders = o, .receivers = {}, .technique = {}, .output = {}, .warnings = {}};
    expect_error(error_of([&] { engine().mask(scene, SoftShadowMap{}); }), ErrorCode::invalid_input, {"occluders.depth.back", "objects"});
    scene.receivers.camera = light_view();
    expect_error(error_of([&] { engine().mask(scene, front); }), ErrorCode::invalid_input, {"receivers.depth", "objects"});
    expect_error(error_of([&] { engine().mask(scene, RayTraced{}); }), ErrorCode::invalid_input, {"objects", "ray_traced"});
}

TEST(EngineErrors, LightsThatATechniqueCannotTake)
{
    const Occluders o = occluders(light_view(), flat(8, 8, 2));
    const SphereLight sphere{.center = {0, 0, 0}, .radius = 1, .direction = {0, 0, -1}, .up = {}};
    expect_error(prepare_error(sphere, o, SoftShadowMap{.visibility = PatchVisibility::sum, .sides = Sides::front}), ErrorCode::invalid_input,
                 {"technique.visibility", "sphere", "union", "0.886"});
    const DirectionalLight sun{.direction = {0, 0, -1}, .angular_diameter_deg = 0.5, .up = {}};
    expect_error(prepare_error(sun, o, SoftShadowVolume{}), ErrorCode::unsupported, {"light.kind", "directional", "soft_shadow_volume"});
    RectangleLight textured = rectangle_light(1, 1);
    textured.emission = Image{.width = 1, .height = 1, .channels = 1, .pixels = {1}};
    expect_error(prepare_error(textured, o, OcclusionTexture{}), ErrorCode::unsupported, {"light.emission", "occlusion_texture"});
    expect_error(prepare_error(textured, o, ShadowMap{}), ErrorCode::unsupported, {"light.emission", "shadow_map", "soft_shadow_map, soft_shadow_volume", "ray_traced"});
    expect_error(prepare_error(RectangleLight{.center = {0, 0, 0}, .half_u = {1, 0, 0}, .half_v = {1, 1, 0}, .emission = {}}, o, front),
                 ErrorCode::invalid_input, {"light.half_v"});

    // A sphere of no radius is a point.
    EXPECT_NO_THROW(engine().prepare(SphereLight{.center = {0, 0, 0}, .radius = 0, .direction = {0, 0, -1}, .up = {}}, o, front));
}

TEST(EngineErrors, OccludersAreSeenFromTheLight)
{
    const auto pinhole = [](const Frame& frame) {
        Occluders o = occluders(light_view(), flat(8, 8, 2));
        o.camera = PinholeCamera{.frame = frame, .tan_half_fov = {1, 1}};
        return o;
    };
    Frame beside, turned;
    beside.origin = {0.1, 0, 0};
    turned.x = {0, 1, 0};
    turned.y = {-1, 0, 0};
    for (const Frame& frame : {beside, turned})
        expect_error(prepare_error(rectangle_light(1, 1), pinhole(frame), front), ErrorCode::invalid_input,
                     {"occluders.camera", "light's own view"});

    // The light's own place and axes, said as a pinhole, are the light's view.
    const Receivers r = receivers(light_view(), flat(16, 16, 5));
    const Mask a = engine().shade(engine().prepare(rectangle_light(1, 1), pinhole({}), front), r);
    const Mask b = engine().shade(engine().prepare(rectangle_light(1, 1), occluders(light_view(), flat(8, 8, 2)), front), r);
    EXPECT_EQ(a.visibility.pixels, b.visibility.pixels);
}

TEST(EngineErrors, CamerasWithoutAView)
{
    expect_error(prepare_error(rectangle_light(1, 1), occluders(LightCamera{}, flat(8, 8, 2)), front), ErrorCode::invalid_input,
                 {"occluders.camera.tan_half_fov"});
    const Prepared prepared = engine().prepare(rectangle_light(1, 1), occluders(light_view(), flat(8, 8, 2)), front);
    expect_error(error_of([&] { engine().shade(prepared, receivers(LightCamera{}, flat(8, 8, 4))); }), ErrorCode::invalid_input,
                 {"receivers.camera.tan_half_fov"});
    expect_error(error_of([&] { engine().shade(prepared, receivers(light_view(-1), flat(8, 8, 4))); }), ErrorCode::invalid_input,
                 {"receivers.camera"});
}

TEST(EngineErrors, NoSuchDevice)
{
    for (const std::string selector : {"no device has this name", "99"})
        expect_error(error_of([&] { Engine(selector).device(); }), ErrorCode::device, {selector});
}

TEST(EngineErrors, RaysNeedObjects)
{
    expect_error(prepare_error(rectangle_light(1, 1), occluders(light_view(), flat(8, 8, 2)), RayTraced{}), ErrorCode::usage,
                 {"ray_traced needs objects"});
}

} // namespace
} // namespace penumbra::test
