// The description of the scene file against the parser: they know the same keys, ranges and defaults.
#include <set>

#include <nlohmann/json.hpp>

#include "io/scene_check.hpp"
#include "io/scene_description.hpp"
#include "io/scene_support.hpp"

using namespace penumbra;
using namespace penumbra::test;
using Json = nlohmann::json;

namespace {

namespace description = penumbra::scene_file;
using description::Form;
using description::Key;

// One form of an object, where it stands in a scene that can be read, and the path that errors about it begin with.
struct Place {
    const Form* form;
    Json scene;
    Json::json_pointer at;
    std::string path;

    Json& held() { return scene[at]; }
    std::string key_path(std::string_view key) const { return path.empty() ? std::string(key) : path + "." + std::string(key); }
};

// Where the directory of the tests has a mesh, names lead to it; what it is does not matter here.
class AnyFile : public MemoryResources {
public:
    AnyFile() : MemoryResources(test::parts()) {}
    Bytes bytes(const std::string& name) const override
    {
        return MemoryResources::bytes(name == "emission.exr" || name == "position.exr" ? "light.exr" : "depth.exr");
    }
    std::string path(const std::string&) const override { return std::string(PENUMBRA_FUZZ_CORPUS) + "/mesh_obj/cube.obj"; }
};

Scene read(const Json& scene)
{
    static const AnyFile resources;
    return parse_scene(scene.dump(), resources);
}

// A key's value in a form: an example, or the kind that the form asks for.
Json example_of(const Key& key)
{
    if (const auto* constant = std::get_if<description::Constant>(&key.type))
        return std::visit([](const auto& value) { return Json(value); }, constant->value);
    return Json::parse(key.example);
}

Json smallest(const Form& form)
{
    Json json = Json::object();
    for (const Key& key : form.keys)
        if (key.required || (!form.exactly_one.empty() && form.exactly_one.front() == key.name)) json[std::string(key.name)] = example_of(key);
    return json;
}

Json scene_with(const char* light)
{
    Json scene = Json::parse(R"({"penumbra": 1, "objects": [{"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}}]})");
    scene["light"] = Json::parse(light);
    return scene;
}

const char* const lamp = R"({"kind": "point", "center": [0, 6, 0]})";
const char* const sunlight = R"({"kind": "directional", "angular_diameter_deg": 0.53})";

// Where an object of the description can stand.
std::vector<std::pair<std::string, std::string>> homes(const description::Object& object)
{
    static const std::map<std::string_view, std::vector<std::pair<std::string, std::string>>> all{
        {"scene", {{"", ""}}},
        {"light", {{"/light", "light"}}},
        {"listed_light", {{"/lights/0", "lights[0]"}}},
        {"object", {{"/objects/0", "objects[0]"}}},
        {"quad", {{"/objects/0/quad", "objects[0].quad"}}},
        {"occluders", {{"/occluders", "occluders"}, {"/lights/0/occluders", "lights[0].occluders"}}},
        {"occluder_depth", {{"/occluders/depth", "occluders.depth"}}},
        {"receivers", {{"/receivers", "receivers"}}},
        {"camera", {{"/receivers/camera", "receivers.camera"}, {"/occluders/camera", "occluders.camera"}}},
        {"intrinsics", {{"/receivers/camera/intrinsics", "receivers.camera.intrinsics"}}},
        {"encoding", {{"/receivers/encoding", "receivers.encoding"}, {"/occluders/encoding", "occluders.encoding"}}},
        {"anchor", {{"/receivers/encoding/anchors/0", "receivers.encoding.anchors[0]"}}},
        {"output", {{"/output", "output"}}}};
    return all.at(object.name);
}

std::vector<Place> places()
{
    std::vector<Place> result;
    for (const description::Object* object : description::objects())
        for (const Form& form : object->forms)
            for (const auto& [pointer, path] : homes(*object)) {
                const bool sun = &form == &description::camera().forms[description::sun_camera_form];
                Place place{&form, scene_with(sun ? sunlight : lamp), Json::json_pointer(pointer), path};
                if (pointer.starts_with("/lights")) {
                    place.scene["lights"] = Json::array({place.scene["light"]});
                    place.scene.erase("light");
                }
                if (object->name == "intrinsics") {
                    place.scene["receivers"]["camera"] = smallest(description::camera().forms[description::looking_camera_form]);
                    place.scene["receivers"]["camera"].erase("vertical_fov_deg");
                }
                if (object->name == "anchor")
                    place.scene["receivers"]["encoding"] = {{"kind", "disparity"}, {"anchors", {nullptr, {{"pixel", {1, 1}}, {"depth", 2}}}}};
                if (!pointer.empty()) place.held() = smallest(form);
                result.push_back(std::move(place));
            }
    return result;
}

// All that the parser makes of a scene, as text.
std::string made_of(const Scene& scene)
{
    DepthNames names;
    const auto name_all = [](const Light& light, const Occluders& occluders, LightNames& named) {
        named.front = occluders.front ? "front" : "";
        named.back = occluders.back ? "back" : "";
        named.layers.assign(occluders.layers.size(), "layer");
        if (const auto* rectangle = std::get_if<RectangleLight>(&light)) {
            named.emission = rectangle->emission ? "emission" : "";
            named.frames.assign(rectangle->frames.size(), "frame");
        }
    };
    name_all(scene.light, scene.occluders, names);
    names.lights.resize(scene.lights.size());
    for (std::size_t i = 0; i < scene.lights.size(); ++i)
        name_all(scene.lights[i].light, scene.lights[i].occluders.value_or(Occluders{}), names.lights[i]);
    std::string text = write_scene(scene, names);
    const auto add = [&text](const std::optional<DepthMap>& map) {
        if (map) text += Json(map->depth).dump();
    };
    add(scene.receivers.depth);
    add(scene.occluders.front);
    for (const penumbra::Object& object : scene.objects) {
        text += object.name + (object.casts ? " casts" : "") + (object.receives ? " receives" : "");
        for (const Imath::V3f& p : object.mesh.positions) text += Json({p.x, p.y, p.z}).dump();
    }
    return text;
}

// Keys that cannot stand beside what the smallest scene has.
void make_room(Place& place, std::string_view key)
{
    for (const std::string_view other : place.form->exactly_one)
        if (!place.path.empty() && other != key && std::ranges::find(place.form->exactly_one, key) != place.form->exactly_one.end())
            place.held().erase(std::string(other));
    // A light's camera sees no positions.
    if (key == "position" && place.path == "receivers")
        place.held()["camera"] = smallest(description::camera().forms[description::looking_camera_form]);
    if (!place.path.empty()) return;
    if (key == "lights") place.scene.erase("light");
    if (key == "light") place.scene.erase("lights");
}

} // namespace

TEST(SceneDescription, TheParserTakesEveryKeyAndNoOther)
{
    for (Place& place : places()) {
        SCOPED_TRACE(place.path + " " + std::string(place.form->name));
        EXPECT_NO_THROW(read(place.scene)) << place.scene;
        for (const Key& key : place.form->keys) {
            Place with = place;
            make_room(with, key.name);
            with.held()[std::string(key.name)] = example_of(key);
            EXPECT_NO_THROW(read(with.scene)) << key.name << " in " << with.scene;
        }
        Place unknown = place;
        unknown.held()["no_key"] = 1;
        const Error error = error_of([&] { read(unknown.scene); });
        EXPECT_EQ(error.path(), place.key_path("no_key")) << error.what();
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        for (const Key& key : place.form->keys) EXPECT_MENTIONS(error, std::string(key.name));
    }
}

TEST(SceneDescription, KeysOfOneFormAreNoneOfAnother)
{
    for (const description::Object* object : {&description::light(), &description::listed_light(), &description::encoding()}) {
        std::set<std::string_view> all;
        for (const Form& form : object->forms)
            for (const Key& key : form.keys) all.insert(key.name);
        for (Place& place : places())
            for (const std::string_view key : all) {
                const auto has = [key](const Key& own) { return own.name == key; };
                if (&*object->forms.begin() > place.form || place.form > &object->forms.back()) continue;
                if (std::ranges::any_of(place.form->keys, has)) continue;
                Place with = place;
                with.held()[std::string(key)] = 1;
                EXPECT_EQ(error_of([&] { read(with.scene); }).path(), place.key_path(key)) << with.scene;
            }
    }
}

TEST(SceneDescription, NeededKeysAreNeeded)
{
    for (Place& place : places())
        for (const Key& key : place.form->keys) {
            if (!key.required || place.form->keys.front().name == "mesh" || key.name == "quad" || key.name == "depth") continue;
            if (key.name == "eye" || key.name == "world_from_camera") continue; // they decide the form
            if (key.name == "kind" && place.path.ends_with("encoding")) continue; // planar without it
            Place without = place;
            without.held().erase(std::string(key.name));
            const Error error = error_of([&] { read(without.scene); });
            EXPECT_EQ(error.path(), place.key_path(key.name)) << error.what();
            EXPECT_EQ(error.message(), "is missing");
        }
}

TEST(SceneDescription, DefaultsAreWhatTheParserGives)
{
    int compared = 0;
    for (Place& place : places())
        for (const Key& key : place.form->keys) {
            if (key.fallback.empty()) continue;
            Place without = place, with = place;
            if (without.held().contains(key.name)) without.held().erase(std::string(key.name));
            with.held()[std::string(key.name)] = Json::parse(key.fallback);
            // A scene without objects has to have something else in it.
            for (Place* each : {&without, &with})
                if (place.path.empty() && key.name == "objects") each->scene["receivers"] = {{"depth", "receiver.exr"}};
            EXPECT_EQ(made_of(read(without.scene)), made_of(read(with.scene))) << place.key_path(key.name);
            EXPECT_EQ(key.otherwise, "") << "one default is enough";
            ++compared;
        }
    EXPECT_GE(compared, 30);
}

TEST(SceneDescription, EveryKeySaysWhatItIsWithoutAValue)
{
    for (const description::Object* object : description::objects())
        for (const Form& form : object->forms)
            for (const Key& key : form.keys) {
                EXPECT_FALSE(key.meaning.empty()) << object->name << " " << key.name;
                EXPECT_EQ(key.required, key.fallback.empty() && key.otherwise.empty()) << object->name << " " << key.name;
                EXPECT_TRUE(!key.example.empty() || std::holds_alternative<description::Constant>(key.type)) << key.name;
            }
}

namespace {

// Values at the ends of a range, and the next ones outside of it.
struct Ends {
    std::vector<Json> inside, outside;
};

Ends ends_of(const description::Number& range)
{
    // Inside an open end, in place of the smallest double: a value whose tangent, too, is no 0.
    constexpr double little = 1e-300;
    Ends ends;
    // The largest number of all goes with no other key: that it is refused beyond says the range.
    if (range.low > -description::largest) {
        ends.inside.push_back(range.above_low ? range.low + little : range.low);
        ends.outside.push_back(range.above_low ? range.low : std::nextafter(range.low, -INFINITY));
    }
    if (range.high < description::largest) ends.inside.push_back(range.below_high ? std::nextafter(range.high, 0) : range.high);
    ends.outside.push_back(range.below_high ? range.high : std::nextafter(range.high, INFINITY));
    ends.outside.push_back(std::nextafter(-description::largest, -INFINITY));
    ends.outside.push_back("1");
    ends.outside.push_back(nullptr);
    return ends;
}

Ends ends_of(const description::OneOfIntegers& integers)
{
    Ends ends{{}, {"8", 8.0, true}};
    for (const int value : integers.values) {
        ends.inside.push_back(value);
        ends.outside.push_back(value + 1);
        ends.outside.push_back(value - 1);
    }
    return ends;
}

Ends ends_of(const description::Boolean&) { return {{true, false}, {0, 1, "true", nullptr}}; }
Ends ends_of(const description::Text&) { return {{}, {"", 1, "a\nb", nullptr}}; }
Ends ends_of(const description::File&) { return {{"depth.exr"}, {"", 1, Json::array(), nullptr}}; }
Ends ends_of(const description::Pair& pair)
{
    const double high = pair.high, above = std::nextafter(high, INFINITY);
    return {{1e-9, {1e-9, high}}, {0, {1, 0}, {0, 1}, {1}, {1, 1, 1}, "1", -1, above, {1, above}}};
}

Ends ends_of(const description::Numbers& numbers)
{
    return {{}, {1, Json(std::vector<double>(numbers.count - 1, 1)), Json(std::vector<double>(numbers.count + 1, 1)), "1", nullptr}};
}

Ends ends_of(const description::Size& size)
{
    const std::int64_t low = size.low, high = size.high;
    return {{{low, high}, {high, low}}, {{low - 1, 1}, {1, low - 1}, {high + 1, 1}, {1, high + 1}, {1}, {1, 1, 1}, {1.5, 1}, 1}};
}

Ends ends_of(const description::Files& files)
{
    Ends ends{{}, {1, Json::array({1}), nullptr}};
    const auto list = [](std::size_t count) { return Json(std::vector<std::string>(count, "depth.exr")); };
    ends.inside.push_back(list(files.low));
    if (files.high < 100000) {
        ends.inside.push_back(list(files.high));
        ends.outside.push_back(list(files.high + 1));
    }
    if (files.low > 0) ends.outside.push_back(list(files.low - 1));
    (files.or_one ? ends.inside : ends.outside).push_back("depth.exr");
    return ends;
}

Ends ends_of(const description::FileTable&)
{
    return {{Json::object(), {{"a b.bin", "depth.exr"}}}, {1, "depth.exr", Json::array({"depth.exr"}), nullptr}};
}

template <class Other> Ends ends_of(const Other&) { return {}; }

} // namespace

TEST(SceneDescription, RangesEndWhereTheySay)
{
    for (Place& place : places())
        for (const Key& key : place.form->keys) {
            const Ends ends = std::visit([](const auto& type) { return ends_of(type); }, key.type);
            Place with = place;
            if (place.form->name == "output" && key.name == "bits") with.held()["format"] = "tif";
            const std::string path = place.key_path(key.name);
            make_room(with, key.name);
            // An encoding's near lies before its far, a light's weights are not all 0.
            if (key.name == "far") with.held()["near"] = 1e-301;
            if (key.name == "weight") with.scene["lights"].push_back({{"kind", "point"}, {"center", {0, 1, 0}}, {"name", "other"}});
            if (key.name == "weight")
                with.scene["receivers"]["camera"] = smallest(description::camera().forms[description::looking_camera_form]);
            for (const Json& value : ends.inside) {
                with.held()[std::string(key.name)] = key.name == "position" ? Json("position.exr") : value;
                EXPECT_NO_THROW(read(with.scene)) << path << " " << value.dump().substr(0, 80);
            }
            for (const Json& value : ends.outside) {
                with.held()[std::string(key.name)] = value;
                const Error error = error_of([&] { read(with.scene); });
                EXPECT_EQ(error.code(), ErrorCode::invalid_input) << path << " " << value.dump().substr(0, 80) << ": " << error.what();
                EXPECT_TRUE(error.path() == path || error.path().starts_with(path + "["))
                    << value.dump().substr(0, 80) << ": " << error.what();
            }
        }
}

TEST(SceneDescription, FilesStandWhereTheDescriptionSays)
{
    const std::vector<std::string> expected{"light.emission",
                                            "light.emission[]",
                                            "lights[].emission",
                                            "lights[].emission[]",
                                            "lights[].occluders.depth.front",
                                            "lights[].occluders.depth.back",
                                            "lights[].occluders.depth.layers[]",
                                            "objects[].mesh",
                                            "objects[].files{}",
                                            "objects[].depth",
                                            "objects[].position",
                                            "occluders.depth.front",
                                            "occluders.depth.back",
                                            "occluders.depth.layers[]",
                                            "receivers.depth",
                                            "receivers.position"};
    EXPECT_EQ(description::file_places(), expected);
}
