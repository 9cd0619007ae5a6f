// How images store depth.
#include "io/scene_description.hpp"

#include "scene/depth.hpp"

namespace penumbra::scene_file {
namespace {

constexpr std::size_t most_anchors = 65536;

// Every encoding has these.
std::vector<Key> stored(std::vector<Key> keys)
{
    keys.push_back({.name = "scale",
                    .type = Number{},
                    .meaning = "multiplies the decoded depth; not 0, and below 0 where camera-space z is stored",
                    .fallback = "1",
                    .example = "0.5"});
    keys.push_back({.name = "empty",
                    .type = Number{},
                    .meaning = "the stored value that means nothing there",
                    .otherwise = "what is not finite, not positive (with a negative `scale` not negative), or at least 1e9 (in a half-float image 65504); in a "
                                 "`window` 1",
                    .example = "0"});
    keys.push_back({.name = "precision",
                    .type = Number{.low = 0, .high = 1, .above_low = true},
                    .meaning = "standard error of a depth over the depth: the image's noise",
                    .otherwise = "estimated from the image, and reported",
                    .example = "0.001"});
    keys.push_back({.name = "channel",
                    .type = Text{},
                    .meaning = "the image's channel",
                    .otherwise = "the one that is called depth (`Z`, `depth`, `*.Depth.Z`, `ZDepth.R`), or the only one beside alpha",
                    .example = "\"Z\""});
    keys.push_back({.name = "part",
                    .type = NameOrNumber{},
                    .meaning = "the part of a multi-part EXR, or the page of a TIFF; numbers count from 0",
                    .otherwise = "the one that holds the channel",
                    .example = "\"depth\""});
    return keys;
}

// The kind that counts where none is said.
Key default_kind(std::string_view name)
{
    Key key = kind(name);
    key.required = false;
    key.fallback = "\"planar\"";
    return key;
}

Key near(bool zero_allowed)
{
    return {.name = "near",
            .type = Number{.low = 0, .above_low = !zero_allowed},
            .meaning = zero_allowed ? "the depth that 0 stands for; not `far`, and above it where white is near"
                                    : "the depth that the nearest value stands for; below `far`",
            .unit = "length",
            .required = true,
            .example = "0.5"};
}

Key far(bool required, std::string_view meaning = "the depth that the furthest value stands for")
{
    return {.name = "far",
            .type = Number{.low = 0, .above_low = true},
            .meaning = meaning,
            .unit = "length",
            .required = required,
            .otherwise = required ? "" : "infinite",
            .example = "100"};
}

} // namespace

const Object& encoding()
{
    const auto form = [](std::string_view name, std::string_view of, std::string_view meaning, std::vector<Key> range) {
        range.insert(range.begin(), kind(name));
        if (name == "planar") range.front() = default_kind(name);
        return Form{.name = name, .of = of, .meaning = meaning, .keys = stored(std::move(range))};
    };
    static const Object object{
        "encoding",
        "How an image stores depth: positive and planar unless `kind` says otherwise.",
        {form("planar", "of planar depth", "distance along the viewing axis", {}),
         form("radial", "of radial depth", "distance to the camera's centre; needs a perspective camera with its field of view", {}),
         form("disparity", "of disparity depth", "1 / planar depth; as networks and stereo give it, up to `scale` and `shift`",
              {{.name = "shift",
                .type = Number{},
                .meaning = "with it, 1 / depth = value x `scale` + `shift`; without, depth = `scale` / value",
                .unit = "1 / length",
                .otherwise = "none",
                .example = "0.45"},
               {.name = "anchors",
                .type = List{anchor, 2, most_anchors},
                .meaning = "pixels of known depth, in place of `scale` and `shift`, which are solved from them by least squares",
                .otherwise = "none",
                .example = R"([{"pixel": [0, 0], "depth": 2}, {"pixel": [3, 2], "depth": 5}])"}}),
         form("window", "of window depth", "a depth buffer, 0 at `near`, 1 at `far`, which is nothing there", {near(false), far(true)}),
         form("reversed_window", "of reversed_window depth", "a depth buffer, 1 at `near`, 0 at `far`, which is nothing there", {near(false), far(false)}),
         form("normalized", "of normalized depth", "0 at `near`, 1 at `far`, linear; either may be the greater", {near(true), far(true, "the depth that 1 stands for")})}};
    static_assert(static_cast<int>(EncodingKind::normalized) == 5, "the forms are in the order of EncodingKind");
    return object;
}

const Object& anchor()
{
    static const Object object = of_one_form("anchor", "A pixel of known depth.",
                                             {{.name = "pixel",
                                               .type = Numbers{2},
                                               .meaning = "column and row, from 0 at the top left",
                                               .unit = "pixels",
                                               .required = true,
                                               .example = "[0, 0]"},
                                              {.name = "depth",
                                               .type = Number{.low = 0, .above_low = true},
                                               .meaning = "planar depth there",
                                               .unit = "length",
                                               .required = true,
                                               .example = "2"}});
    return object;
}

} // namespace penumbra::scene_file
