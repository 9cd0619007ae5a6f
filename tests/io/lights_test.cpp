// Several lights and sequences of emission in the scene file.
#include "io/scene_support.hpp"
#include "scene/lights.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

const std::string lamp = R"("kind": "point", "center": [0, 6, 0])";
const std::string panel = R"("kind": "rectangle", "center": [1, 6, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -1])";
const std::string viewpoint = R"("camera": {"kind": "pinhole", "eye": [0, 5, 5], "target": [0, 0, 0], "vertical_fov_deg": 40})";
const std::string seen = ", \"receivers\": {" + viewpoint + "}, " + quad;

std::string lights(const std::string& list, const std::string& rest = seen) { return scene_of("\"lights\": [" + list + "]" + rest); }

void expect_error(const std::string& json, const std::string& start, const std::string& part = "")
{
    SCOPED_TRACE(json);
    const Error error = error_of([&] { parse(json); });
    EXPECT_EQ(exit_code(error.code()), 2) << error.what();
    EXPECT_EQ(std::string(error.what()).rfind(start, 0), 0u) << error.what();
    EXPECT_MENTIONS(error, part);
}

} // namespace

TEST(SceneLights, NamesAndWeightsHaveDefaults)
{
    const Scene scene = parse(lights("{" + lamp + "}, {" + panel + R"(, "name": "key-Light_2", "weight": 0.25})"));
    ASSERT_EQ(scene.lights.size(), 2u);
    EXPECT_EQ(scene.lights[0].name, "1");
    EXPECT_EQ(scene.lights[0].weight, 1);
    EXPECT_TRUE(std::holds_alternative<PointLight>(scene.lights[0].light));
    EXPECT_FALSE(scene.lights[0].occluders);
    EXPECT_EQ(scene.lights[1].name, "key-Light_2");
    EXPECT_EQ(scene.lights[1].weight, 0.25);
    EXPECT_EQ(std::get<RectangleLight>(scene.lights[1].light).center, Vec3(1, 6, 0));
    EXPECT_EQ(frame_count(scene), 0);
}

TEST(SceneLights, OneInAListMayBeTheReceiversCamera)
{
    const Scene scene = parse(lights("{" + lamp + "}", ", " + quad));
    EXPECT_TRUE(std::holds_alternative<LightCamera>(scene.receivers.camera));
}

TEST(SceneLights, ExactlyOneOfLightAndLights)
{
    expect_error(scene_of(quad), "light: is missing", "lights");
    expect_error(scene_of(point + ", \"lights\": [{" + lamp + "}]" + seen), "lights: stands beside light");
    expect_error(lights(""), "lights: has no light");
    expect_error(scene_of("\"lights\": {" + lamp + "}" + seen), "lights: is an object");
    expect_error(lights("{" + lamp + "}, 3"), "lights[1]: is 3, expected an object");
}

TEST(SceneLights, NamesAreNamesAndStandOnce)
{
    const auto named = [](const std::string& name) { return "{" + lamp + ", \"name\": " + name + "}"; };
    for (const std::string& name : {std::string(R"("a b")"), std::string(R"("../a")"), std::string(R"("a.b")"), std::string("\"\u00e4\""),
                                   "\"" + std::string(65, 'x') + "\""})
        expect_error(lights(named(name)), "lights[0].name: is no name", "A-Z a-z 0-9 _ -");
    expect_error(lights(named("\"\"")), "lights[0].name:");
    expect_error(lights(named("7")), "lights[0].name: is 7, expected a string");
    expect_error(lights(named("\"a\"") + ", " + named("\"b\"") + ", " + named("\"a\"")),
                 "lights[2].name: a is the name of an earlier light");
    expect_error(lights(named("\"2\"") + ", {" + lamp + "}"), "lights[1].name: 2 is the name"); // the default of the second
    EXPECT_EQ(parse(lights(named("\"" + std::string(64, 'x') + "\""))).lights[0].name.size(), 64u);
}

TEST(SceneLights, WeightsArePowers)
{
    const auto weighing = [](const std::string& weight) { return "{" + lamp + ", \"weight\": " + weight + "}"; };
    expect_error(lights(weighing("-1")), "lights[0].weight: is -1", "0 or more");
    expect_error(lights(weighing("\"1\"")), "lights[0].weight: is the string");
    expect_error(lights(weighing("NaN")), "is not JSON");
    expect_error(lights(weighing("0") + ", " + weighing("0.0")), "lights: have weight 0, all of them");
    expect_error(lights(weighing("1.7e308").insert(1, "\"name\": \"a\", ") + ", " + weighing("1.7e308")),
                 "lights: have weights with a sum");
    EXPECT_EQ(parse(lights(weighing("0") + ", " + weighing("1e-300"))).lights[0].weight, 0);
}

TEST(SceneLights, AsManyAsTheFormatHas)
{
    std::string list = "{" + lamp + "}";
    for (std::size_t i = 1; i < max_lights; ++i) list += ", {" + lamp + "}";
    EXPECT_EQ(parse(lights(list)).lights.size(), max_lights);
    expect_error(lights(list + ", {" + lamp + "}"), "lights: are 257", "at most 256");
}

TEST(SceneLights, ErrorsOfALightNameItsPlace)
{
    expect_error(lights("{" + lamp + "}, {\"kind\": \"sphere\", \"center\": [0, 1, 0], \"radius\": -2}"), "lights[1].radius: is -2");
    expect_error(lights("{" + lamp + ", \"radius\": 1}"), "lights[0].radius: is an unknown key of a point", "weight");
    expect_error(lights("{" + panel + ", \"emission\": \"black.exr\"}"), "lights[0].emission: is black");
    expect_error(lights("{" + panel + ", \"emission\": \"nowhere.exr\"}"), "lights[0].emission: ");
    // A light by itself has no place in a list.
    expect_error(scene_of("\"light\": {" + lamp + ", \"weight\": 1}, " + quad), "light.weight: is an unknown key");
}

TEST(SceneLights, ReceiversAndObjectsCannotBeSeenFromSeveralLights)
{
    const std::string two = "{" + lamp + "}, {" + panel + "}";
    expect_error(lights(two, ", " + quad), "receivers.camera: is the light's own", "pinhole");
    expect_error(lights(two, R"(, "receivers": {"camera": {"kind": "light"}}, )" + quad), "receivers.camera: is the light's own",
                 "pinhole");
    expect_error(lights(two, R"(, "receivers": {)" + viewpoint +
                                 R"(}, "objects": [{"depth": "depth.exr", "camera": {"kind": "light", "tan_half_fov": 1}}])"),
                 "objects[0].camera: is the light's own", "pinhole");
}

TEST(SceneLights, OccludersAreSharedOrOfEach)
{
    const std::string map = R"("occluders": {"camera": {"kind": "light", "tan_half_fov": 1}, "depth": {"front": "depth.exr"}})";
    const std::string receivers = R"(, "receivers": {)" + viewpoint + "}, ";
    const Scene own = parse(lights("{" + lamp + ", " + map + "}, {" + panel + "}", receivers + quad));
    ASSERT_TRUE(own.lights[0].occluders);
    EXPECT_EQ(own.lights[0].occluders->width, 4);
    EXPECT_FALSE(own.lights[1].occluders);

    const std::string both = "{" + lamp + "}, {" + panel + "}";
    expect_error(lights(both, receivers + map), "occluders.depth: is seen from one light, and 2 lights share it", "lights[0].occluders");
    // One light alone has it.
    EXPECT_TRUE(parse(lights("{" + lamp + "}, {" + panel + ", " + map + "}", receivers + map)).occluders.front);
    expect_error(lights("{" + lamp + ", " + map + "}", receivers + map), "occluders: serves no light");
    expect_error(lights("{" + lamp + R"(, "occluders": {"depht": 1}})"), "lights[0].occluders.depht");
    // Rendered from objects, each light has its own view; a directional light's camera reads differently.
    const std::string camera = R"("occluders": {"camera": {"kind": "light", "tan_half_fov": 1}}, )";
    EXPECT_EQ(parse(lights(both, receivers + camera + quad)).lights.size(), 2u);
    expect_error(lights("{" + lamp + R"(}, {"kind": "directional", "angular_diameter_deg": 1})", receivers + camera + quad),
                 "occluders.camera.tan_half_fov: is an unknown key", "directional");
}

TEST(SceneSequence, ImagesInOrder)
{
    const auto with = [](const std::string& emission) {
        return "\"kind\": \"rectangle\", \"center\": [0, 6, 0], \"half_u\": [1, 0, 0], \"half_v\": [0, 0, -1], \"emission\": " + emission;
    };
    const auto one = [&](const std::string& emission) { return scene_of("\"light\": {" + with(emission) + "}, " + quad); };

    MemoryResources resources = parts();
    resources.parts["other.exr"] = encode_image(ramp(3, 1, 3), {"exr", 32}); // frames need not be of one size
    const Scene scene = parse_scene(one(R"(["light.exr", "other.exr", "light.exr"])"), resources);
    EXPECT_EQ(frame_count(scene), 3);
    const RectangleLight& light = std::get<RectangleLight>(scene.light);
    EXPECT_FALSE(light.emission);
    EXPECT_EQ(light.frames[0].width, 2);
    EXPECT_EQ(light.frames[1].pixels, ramp(3, 1, 3).pixels);
    EXPECT_EQ(light.frames[2].pixels, light.frames[0].pixels);

    const Scene second = only_frame(scene, 2);
    EXPECT_EQ(frame_count(second), 0);
    EXPECT_EQ(std::get<RectangleLight>(second.light).emission->pixels, light.frames[1].pixels);

    expect_error(one("[]"), "light.emission: has 0 images", "1 to 4096");
    expect_error(one(R"(["light.exr", 3])"), "light.emission[1]: is 3, expected a string");
    expect_error(one(R"(["light.exr", "depth.exr"])"), "light.emission[1]: has 1 channels", "expected 3");
    expect_error(one(R"(["light.exr", "alpha.exr"])"), "light.emission[1]: has 4 channels");
    expect_error(one(R"(["depth.exr", "black.exr"])"), "light.emission[1]: is black");
    expect_error(one(R"(["light.exr", "nowhere.exr"])"), "light.emission[1]: ");
    std::string many = "\"light.exr\"";
    for (std::size_t i = 0; i < max_frames; ++i) many += ", \"light.exr\"";
    expect_error(one("[" + many + "]"), "light.emission: has 4097 images", "4096");
}

TEST(SceneSequence, TogetherAsLargeAsOneImage)
{
    MemoryResources resources = parts();
    resources.limit = 2 * 2 * 3 * 2; // two frames of light.exr
    const auto scene = [](int frames) {
        std::string list = "\"light.exr\"";
        for (int i = 1; i < frames; ++i) list += ", \"light.exr\"";
        return scene_of("\"light\": {" + panel + ", \"emission\": [" + list + "]}, " + quad);
    };
    EXPECT_EQ(frame_count(parse_scene(scene(2), resources)), 2);
    const Error error = error_of([&] { parse_scene(scene(3), resources); });
    EXPECT_EQ(error.code(), ErrorCode::too_large);
    EXPECT_MENTIONS(error, "light.emission: has 36 samples in its first 3 images");
}

TEST(SceneSequence, SeveralLightsHaveOneLength)
{
    const auto with = [](const std::string& emission) { return "{" + panel + ", \"emission\": " + emission + "}"; };
    const std::string two = R"(["light.exr", "light.exr"])", three = R"(["light.exr", "light.exr", "light.exr"])";
    const Scene scene = parse(lights(with(two) + ", " + with("\"depth.exr\"") + ", {" + lamp + "}, " + with(two)));
    EXPECT_EQ(frame_count(scene), 2);
    EXPECT_EQ(frame_count(only_light(scene, "2")), 0);
    EXPECT_EQ(frame_count(only_light(scene, "4")), 2);
    expect_error(lights("{" + lamp + "}, " + with(two) + ", " + with(three)), "lights[2].emission: has 3 frames",
                 "expected 2 as in lights[1].emission");
}

TEST(SceneLights, ChoosingOneAndAFrame)
{
    const std::string map = R"("occluders": {"camera": {"kind": "light", "tan_half_fov": 1}, "depth": {"front": "depth.exr"}})";
    const Scene scene = parse(lights("{" + lamp + ", \"name\": \"a\", " + map + "}, {" + panel + ", \"name\": \"b\"}"));
    const Scene a = only_light(scene, "a"), b = only_light(scene, "b");
    EXPECT_TRUE(a.lights.empty());
    EXPECT_TRUE(std::holds_alternative<PointLight>(a.light));
    EXPECT_TRUE(a.occluders.front);
    EXPECT_FALSE(b.occluders.front);
    EXPECT_EQ(a.objects.size(), scene.objects.size());
    const Error nobody = error_of([&] { only_light(scene, "c"); });
    EXPECT_EQ(nobody.code(), ErrorCode::usage);
    EXPECT_MENTIONS(nobody, "there are: a, b");
    EXPECT_MENTIONS(error_of([&] { only_light(a, "a"); }), "without a name");
    EXPECT_MENTIONS(error_of([&] { only_frame(scene, 1); }), "has no sequence");
    const Scene moving = parse(scene_of("\"light\": {" + panel + R"(, "emission": ["light.exr", "light.exr"]}, )" + quad));
    for (const int frame : {-1, 0, 3}) EXPECT_MENTIONS(error_of([&] { only_frame(moving, frame); }), "expected 1 to 2");
}

TEST(SceneLights, WhatIsWrittenReadsBackEqual)
{
    const std::string map = R"("occluders": {"camera": {"kind": "light", "tan_half_fov": 1}, "depth": {"front": "depth.exr"}})";
    const Scene scene = parse(lights("{" + lamp + ", \"name\": \"a\", \"weight\": 0.1, " + map + "}, {" + panel +
                                     R"(, "emission": ["light.exr", "light.exr"]})"));
    DepthNames names;
    names.lights.resize(2);
    names.lights[0].front = "depth.exr";
    names.lights[1].frames = {"light.exr", "light.exr"};
    const std::string text = write_scene(scene, names);
    Scene back = parse_scene(text.substr(0, text.rfind('}')) + ", " + quad + "}", parts());
    EXPECT_EQ(write_scene(back, names), text);
    EXPECT_EQ(back.lights[0].name, "a");
    EXPECT_EQ(back.lights[0].weight, 0.1);
    EXPECT_EQ(back.lights[0].occluders->front->depth, scene.lights[0].occluders->front->depth);
    EXPECT_EQ(frame_count(back), 2);
    names.lights[1].frames.pop_back();
    EXPECT_MENTIONS(error_of([&] { write_scene(scene, names); }), "2 frames of emission and 1 names");
}
