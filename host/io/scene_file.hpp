// Scene files (JSON, version 1). Knows where names lead only through a Resources object: files for the command line, parts of a request for
// the server.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra {

// Bytes of its own, or a view of bytes that lie elsewhere: what is in memory already is not copied to be read.
class Bytes {
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
class Resources {
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
class FileResources : public Resources {
public:
    explicit FileResources(std::string folder) : folder_(std::move(folder)) {}
    Bytes bytes(const std::string& name) const override;
    std::string path(const std::string& name) const override;

private:
    std::string folder_;
};

// Parses and loads. Every error names its key ("occluders.depth.front: ...").
Scene parse_scene(std::string_view json, const Resources& resources);

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
std::string write_scene(const Scene& scene, const DepthNames& names);

} // namespace penumbra
