// Scene files (JSON, version 1). Knows where names lead only through a Resources object: files for the command line, parts of a request for
// the server.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <penumbra/export.hpp>
#include <penumbra/scene.hpp>

namespace penumbra {

// Bytes of its own, or a view of bytes that lie elsewhere: what is in memory already is not copied to be read.
class PENUMBRA_API Bytes {
public:
    explicit Bytes(std::vector<std::byte> own) : own_(std::move(own)), view_(own_) {}
    explicit Bytes(std::span<const std::byte> elsewhere) : view_(elsewhere) {}
    Bytes(Bytes&&) = default; // a vector's bytes stay where they are when it moves
    Bytes& operator=(Bytes&&) = default;
    operator std::span<const std::byte>() const { return view_; }

private:
    std::vector<std::byte> own_;
    std::span<const std::byte> view_;
};

// Where the names in a scene lead.
class PENUMBRA_API Resources {
public:
    virtual ~Resources() = default;
    // The bytes of what `name` stands for; a view among them is valid as long as this object. Throws not_found.
    virtual Bytes bytes(const std::string& name) const = 0;
    // A path for readers that need files (meshes with companions); throws unsupported where there are no files.
    virtual std::string path(const std::string& name) const = 0;
    // The largest image (width * height * channels) that is decoded; larger ones are refused by their header.
    virtual std::uint64_t max_samples() const { return std::uint64_t{1} << 30; }
};

// Names relative to `folder`.
class PENUMBRA_API FileResources : public Resources {
public:
    explicit FileResources(std::string folder) : folder_(std::move(folder)) {}
    Bytes bytes(const std::string& name) const override;
    std::string path(const std::string& name) const override;

private:
    std::string folder_;
};

// Parses and loads. Every error names its key ("occluders.depth.front: ...").
PENUMBRA_API Scene parse_scene(std::string_view json, const Resources& resources);

// A name from a scene in a message: in double quotes, on one line, cut when long.
PENUMBRA_API std::string in_quotes(std::string_view text);

// A scene file that stays in memory, so that it can be patched and decoded again in parts. Cheap to copy.
class PENUMBRA_API SceneDocument {
public:
    // Throws invalid_input for text that is no JSON.
    explicit SceneDocument(std::string_view json);

    // With a JSON Merge Patch (RFC 7396) merged in; an empty one changes nothing. A light, camera or technique whose `kind` differs from
    // the one before replaces it instead: keys of one kind mean nothing to another. Lists, `lights` among them, are replaced whole. Throws
    // invalid_input for other sections than patched_sections(), naming them.
    SceneDocument patched(std::string_view patch) const;

    // The text of all of it, of a section, or of a light (no place: of `light`), that is the same for the same content; empty: there is
    // none.
    std::string text() const;
    std::string text(std::string_view section) const;
    std::string light_text(std::optional<std::size_t> place) const;
    bool has(std::string_view section) const;

    // Whether a section, or a light, names one of these files.
    bool names_file(std::string_view section, std::span<const std::string_view> files) const;
    bool light_names_file(std::optional<std::size_t> place, std::span<const std::string_view> files) const;
    // Whether one of the objects hangs on the light's own view (its camera is of kind light).
    bool objects_follow_light() const;

    // What the sections say; of those that are not there the defaults. Throws what parse_scene throws.
    OutputFormat output() const;
    TechniqueRequest technique() const;
    // Its light or lights, and what they have before them; `receivers` of their first.
    Scene lights(const Resources& resources) const;
    void add_occluders(Scene& scene, const Resources& resources) const;
    Receivers receivers(const Light& first, const Resources& resources, std::vector<std::string>& warnings) const;
    // Throws where several lights would share the view of one.
    void check_shared_views() const;

private:
    struct State;
    explicit SceneDocument(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    std::shared_ptr<const State> state_;
};
PENUMBRA_API std::span<const std::string_view> patched_sections();

// A JSON Schema (draft 2020-12) of every object of a scene file by its name there ("Scene", "Light"), which refer to each other by `prefix`
// and that name: one JSON object.
PENUMBRA_API std::string scene_definitions_json(std::string_view prefix);

// A scene file's JSON for `scene`, with its depth images under the given names (empty: left out), cameras explicit. Objects are not
// written. Throws usage for an emission without a name, and for more layers, frames or lights than names or the other way round.
struct LightNames {
    std::string front, back;
    std::vector<std::string> layers;
    std::string emission;            // the light's, when it has one
    std::vector<std::string> frames; // of its sequence
};
struct DepthNames : LightNames {
    std::string receiver;
    std::vector<LightNames> lights; // of scene.lights, each with its own occluders
};
PENUMBRA_API std::string write_scene(const Scene& scene, const DepthNames& names);

} // namespace penumbra
