// Cameras, depth images; and what every description has.
#include "io/scene_description.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <penumbra/error.hpp>

namespace penumbra::scene_file {
namespace {

constexpr std::int64_t max_resolution = 65536;

Key tangents(std::string_view otherwise)
{
    return {.name = "tan_half_fov",
            .type = Pair{largest_tangent},
            .meaning = "tangents of the half angles",
            .otherwise = otherwise,
            .example = "[0.5, 0.5]"};
}

// Both ways of placing a pinhole have these.
std::vector<Key> with_lens(std::vector<Key> keys)
{
    keys.push_back({.name = "intrinsics",
                    .type = One{intrinsics},
                    .meaning = "a calibrated camera's lens, in place of the angles",
                    .otherwise = "the angles",
                    .example = R"({"fx": 500, "fy": 500, "cx": 320, "cy": 240})"});
    keys.push_back({.name = "shift",
                    .type = Numbers{2},
                    .meaning = "moves the image in its plane, to the right and up, by this many of its widths and heights",
                    .fallback = "[0, 0]",
                    .example = "[0.1, 0]"});
    return keys;
}

Form light_camera()
{
    return {.name = "light",
            .of = "of a light's camera (half_extent and center are for directional lights)",
            .meaning = "at the light's centre along its axis; image x along +u, image up along +v",
            .keys = {kind("light"), tangents("fitted: of occluders to what casts, but for flat ground; else to the objects")}};
}

Form sun_camera()
{
    return {.name = "light, directional",
            .of = "of a directional light's camera, which is orthographic",
            .meaning = "the same for a directional light: orthographic",
            .keys = {kind("light"),
                     {.name = "half_extent",
                      .type = Pair{},
                      .meaning = "half the width and height",
                      .unit = "length",
                      .otherwise = "fitted: of occluders to what casts, but for flat ground; else to the objects",
                      .example = "[4, 4]"},
                     {.name = "center",
                      .type = Numbers{3},
                      .meaning = "the middle of the image plane, from which depth counts",
                      .unit = "length",
                      .otherwise = "fitted as half_extent is; the origin without objects",
                      .example = "[0, 9, 0]"}}};
}

Form looking_camera()
{
    return {.name = "pinhole, looking",
            .of = "beside eye and target",
            .meaning = "at `eye`, towards `target`",
            .keys = with_lens({kind("pinhole"),
                     {.name = "eye",
                      .type = Numbers{3},
                      .meaning = "where the camera is",
                      .unit = "length",
                      .required = true,
                      .example = "[0, 2, 5]"},
                     {.name = "target",
                      .type = Numbers{3},
                      .meaning = "what it looks at; not where `eye` is",
                      .unit = "length",
                      .required = true,
                      .example = "[0, 0, 0]"},
                     {.name = "up",
                      .type = Numbers{3},
                      .meaning = "upwards in the image; not along the line of sight",
                      .fallback = "[0, 1, 0]",
                      .example = "[1, 0, 0]"},
                     {.name = "vertical_fov_deg",
                      .type = Number{.low = 0, .high = 179.9, .above_low = true},
                      .meaning = "the image's whole height; the width follows its pixels, whose own aspect counts",
                      .unit = "degrees",
                      .otherwise = "`intrinsics`",
                      .example = "40"}}),
            .exactly_one = {"vertical_fov_deg", "intrinsics"}};
}

Form matrix_camera()
{
    return {.name = "pinhole, by matrix",
            .of = "beside world_from_camera",
            .meaning = "placed by a matrix",
            .keys = with_lens({kind("pinhole"),
                     {.name = "world_from_camera",
                      .type = Numbers{16},
                      .meaning = "row-major, for column vectors: translation in elements 3, 7, 11; rigid, last row 0, 0, 0, 1",
                      .required = true,
                      .example = "[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5, 0, 0, 0, 1]"},
                     tangents("`intrinsics`")}),
            .exactly_one = {"tan_half_fov", "intrinsics"}};
}

// The keys that occluders and receivers share, around their depth.
std::vector<Key> viewed(std::string_view camera_meaning, std::string_view resolution, Key depth, std::optional<Key> position = {})
{
    std::vector<Key> keys{{.name = "camera",
             .type = One{camera},
             .meaning = camera_meaning,
             .fallback = R"({"kind": "light"})",
             .example = R"({"kind": "light", "tan_half_fov": 0.5})"},
            {.name = "resolution",
             .type = Size{1, max_resolution},
             .meaning = "`[width, height]`; images of another size are an error",
             .unit = "pixels",
             .otherwise = resolution,
             .example = "[256, 256]"},
            std::move(depth),
            {.name = "encoding",
             .type = One{encoding},
             .meaning = "how these images store depth",
             .fallback = R"({"kind": "planar"})",
             .example = R"({"kind": "radial"})"}};
    if (position) keys.insert(keys.end() - 1, *std::move(position));
    return keys;
}

// Without the zeros behind the point.
std::string text(double value)
{
    std::string digits = std::to_string(value);
    digits.erase(digits.find_last_not_of('0') + 1);
    if (digits.ends_with('.')) digits.pop_back();
    return digits;
}

void add_places(const Object& object, const std::string& prefix, std::vector<std::string>& places)
{
    const auto add = [&places](std::string place) {
        if (std::ranges::find(places, place) == places.end()) places.push_back(std::move(place));
    };
    for (const Form& form : object.forms)
        for (const Key& key : form.keys) {
            const std::string at = prefix + std::string(key.name);
            if (std::holds_alternative<File>(key.type)) add(at);
            if (std::holds_alternative<FileTable>(key.type)) add(at + "{}");
            if (const auto* files = std::get_if<Files>(&key.type)) {
                if (files->or_one) add(at);
                add(at + "[]");
            }
            if (const auto* one = std::get_if<One>(&key.type)) add_places(one->object(), at + ".", places);
            if (const auto* list = std::get_if<List>(&key.type)) add_places(list->object(), at + "[].", places);
        }
}

} // namespace

Key kind(std::string_view name) { return {.name = "kind", .type = Constant{name}, .meaning = "decides the other keys", .required = true}; }

Object of_one_form(std::string_view name, std::string_view meaning, std::vector<Key> keys, std::vector<std::string_view> exactly_one)
{
    return {name, meaning, {{.name = name, .of = {}, .meaning = {}, .keys = std::move(keys), .exactly_one = std::move(exactly_one)}}};
}

const Object& camera()
{
    static const Object object{"camera",
                               "What an image is seen through. It looks along its local -Z with +Y up; image row 0 is the top.",
                               {light_camera(), sun_camera(), looking_camera(), matrix_camera()}};
    return object;
}

const Object& intrinsics()
{
    const auto key = [](std::string_view name, Type type, std::string_view meaning, std::string_view example) {
        return Key{.name = name, .type = std::move(type), .meaning = meaning, .unit = "pixels", .required = true, .example = example};
    };
    constexpr Number length{.low = 0, .above_low = true};
    static const Object object = of_one_form(
        "intrinsics", "A lens as calibration gives it. (0, 0) is the image's top left corner, (0.5, 0.5) the first pixel's middle.",
        {key("fx", length, "focal length across", "500"), key("fy", length, "focal length down", "500"),
         key("cx", Number{}, "where the viewing axis meets the image, from the left", "320"),
         key("cy", Number{}, "the same, from the top", "240")});
    return object;
}

const Object& occluder_depth()
{
    static const Object object{"occluder_depth",
                               "Depth of what casts, seen from the light.",
                               {{.name = "depth",
                                 .of = {},
                                 .meaning = {},
                                 .keys = {{.name = "front",
                                           .type = File{},
                                           .meaning = "nearest surfaces",
                                           .otherwise = "rendered from `objects`",
                                           .example = "\"front.exr\""},
                                          {.name = "back",
                                           .type = File{},
                                           .meaning = "furthest back-facing surfaces",
                                           .otherwise = "rendered from `objects`",
                                           .example = "\"back.exr\""},
                                          {.name = "layers",
                                           .type = Files{0, any_number, false},
                                           .meaning = "further surfaces in order of depth",
                                           .fallback = "[]",
                                           .example = "[\"layer.exr\"]"}}}}};
    return object;
}

const Object& occluders()
{
    static const Object object =
        of_one_form("occluders", "Depth of what casts shadows, seen from the light.",
                    viewed("the light's own view; a `pinhole` must be the same view", "the images' size; `[256, 256]` without any",
                           {.name = "depth",
                            .type = One{occluder_depth},
                            .meaning = "images of depth",
                            .otherwise = "rendered from `objects`",
                            .example = R"({"front": "front.exr"})"}));
    return object;
}

const Object& receivers()
{
    static const Object object = of_one_form("receivers", "Depth of what is shaded. The mask has its viewpoint and resolution.",
                                             viewed("the viewpoint", "the image's size; `[512, 512]` without one",
                                                    {.name = "depth",
                                                     .type = File{},
                                                     .meaning = "image of depth",
                                                     .otherwise = "rendered from `objects`",
                                                     .example = "\"receiver.exr\""},
                                                    Key{.name = "position",
                                                        .type = File{},
                                                        .meaning = "image of world positions, in place of `depth`; needs a pinhole camera",
                                                        .otherwise = "`depth`",
                                                        .example = "\"position.exr\""}));
    return object;
}

std::string_view kind_of(const Form& form)
{
    for (const Key& key : form.keys)
        if (const auto* constant = std::get_if<Constant>(&key.type))
            if (const auto* text = std::get_if<std::string_view>(&constant->value)) return *text;
    return {};
}

const Key& key_of(const Object& object, std::string_view name)
{
    for (const Form& form : object.forms)
        for (const Key& key : form.keys)
            if (key.name == name) return key;
    throw Error(ErrorCode::internal, std::string(object.name) + " has no key " + std::string(name));
}

std::vector<std::string_view> kinds_of(const Object& object)
{
    std::vector<std::string_view> kinds;
    for (const Form& form : object.forms)
        if (const std::string_view kind = kind_of(form); !kind.empty() && std::ranges::find(kinds, kind) == kinds.end())
            kinds.push_back(kind);
    return kinds;
}

std::string expected(const Number& number)
{
    const bool low = number.low > -largest, high = number.high < largest;
    std::string words = "a number";
    if (low) words += number.above_low ? " above " + text(number.low) : ", " + text(number.low) + " or more";
    if (high) words += (low ? " and " : " ") + (number.below_high ? "below " + text(number.high) : text(number.high) + " or less");
    return words;
}

std::string expected(const OneOfIntegers& integers)
{
    std::string list;
    for (const int value : integers.values) list += (list.empty() ? "" : ", ") + std::to_string(value);
    return "one of " + list;
}

const std::vector<std::string>& file_places()
{
    static const std::vector<std::string> all = [] {
        std::vector<std::string> places;
        add_places(scene(), "", places);
        return places;
    }();
    return all;
}

} // namespace penumbra::scene_file
