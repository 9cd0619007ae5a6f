// From the parts of a request to the bytes of a mask, without the sockets.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <penumbra/engine.hpp>

#include "gate.hpp"
#include "mask_cache.hpp"
#include "mask_format.hpp"
#include "multipart.hpp"
#include "options.hpp"

namespace penumbra::server {

// What a mask is computed from, decoded. With a cache, prepared state and rendered receivers are looked up there first, under their keys.
struct MaskTask {
    Light light;
    std::shared_ptr<const Occluders> occluders;
    std::shared_ptr<const Receivers> receivers;
    Geometry geometry;
    Technique technique;
    OutputFormat output;
    std::vector<std::string> warnings;

    MaskCache* cache = nullptr;
    std::string prepared_key, receivers_key;
};

struct StageTime {
    std::string name;
    double ms;
};

struct MaskReply {
    std::string bytes;
    std::string technique;
    std::uint64_t pixels = 0, device_bytes = 0;
    std::vector<StageTime> stages; // those of the report, encode
    double compute_ms = 0, encode_ms = 0;
    std::vector<std::string> warnings;
};

// The part `scene`, or nothing when there is none. Throws Problem 413 when it is over the limit.
const Part* find_scene(std::span<const Part> parts, const Options& options);

// Parses part `scene` and loads what it names. Throws Error and Problem.
Scene decode_scene(std::span<const Part> parts, const Options& options, const Deadline& deadline);

// The task of a scene that came with its request.
MaskTask task_of(std::span<const Part> parts, const Options& options, const Deadline& deadline);

// Prepares, or takes it from the task's cache. Throws Error and Problem.
Prepared prepare(const Engine& engine, const MaskTask& task, const Deadline& deadline);

// The deadline is checked between stages. `format`: what negotiate gave; bits are those of the scene's output when that names the same
// format. Throws Error and Problem.
MaskReply compute_mask(const Engine& engine, const MaskTask& task, const MaskFormat& format, const Options& options,
                       const Deadline& deadline);

// A strong entity tag, quotes and all. `content` names all that was sent (id_of, KeptScene::content_of); the mask depends on that, on the
// format, the program and the device.
std::string etag_of(const Engine& engine, std::string_view content, const MaskFormat& format);

// Whether an If-None-Match header names the tag (RFC 9110, 13.1.2; weak tags of the same text count).
bool names_tag(std::string_view header, std::string_view tag);

// "decode;dur=1.250, shade;dur=3.100"
std::string server_timing(const std::vector<StageTime>& stages);

} // namespace penumbra::server
