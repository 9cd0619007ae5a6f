// From the parts of a request to the bytes of a mask, without the sockets.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <penumbra/engine.hpp>

#include "masks/mask_cache.hpp"
#include "masks/mask_choice.hpp"
#include "masks/mask_format.hpp"
#include "masks/part.hpp"
#include "process/gate.hpp"
#include "process/options.hpp"

namespace penumbra::server {

// One of the lights of a task, at the frame that was asked for. With a cache, what is prepared for it is looked up there first: under
// `key`, which says the frame; of a light with a sequence then under `still_key`, for what all frames share. Empty keys are not kept.
struct TaskLight {
    std::string name; // empty: the scene has no `lights`
    double weight = 1;
    std::size_t place = 0; // in `lights`
    bool own_occluders = false;
    Light light;
    std::shared_ptr<const Occluders> occluders;
    std::string key, still_key;
};

// What a mask is computed from, decoded. With a cache, rendered receivers are looked up there first, under their key.
struct MaskTask {
    std::vector<TaskLight> lights; // at least one; of several the mask is that of all together
    std::shared_ptr<const Receivers> receivers;
    Geometry geometry;
    Technique technique;
    OutputFormat output;
    std::vector<std::string> warnings;

    MaskCache* cache = nullptr;
    std::string receivers_key;
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
MaskTask task_of(std::span<const Part> parts, const MaskChoice& choice, const Options& options, const Deadline& deadline);

// Prepares one of the task's lights, or takes it from the task's cache. Throws Error and Problem.
Prepared prepare(const Engine& engine, const MaskTask& task, const TaskLight& light, const Deadline& deadline);

// Prepares all of them, for the task's cache.
void prepare_all(const Engine& engine, const MaskTask& task, const Deadline& deadline);

// The deadline is checked between stages. `format`: what negotiate gave; bits are those of the scene's output when that names the same
// format. Throws Error and Problem.
MaskReply compute_mask(const Engine& engine, const MaskTask& task, const MaskFormat& format, const Options& options,
                       const Deadline& deadline);

// A strong entity tag, quotes and all. `content` names all that was sent (id_of, KeptScene::content_of); the mask depends on that, on which
// of the scene's it is, on the format, the program and the device.
std::string etag_of(const Engine& engine, std::string_view content, const MaskChoice& choice, const MaskFormat& format);

// Whether an If-None-Match header names the tag (RFC 9110, 13.1.2; weak tags of the same text count).
bool names_tag(std::string_view header, std::string_view tag);

// "decode;dur=1.250, shade;dur=3.100"
std::string server_timing(const std::vector<StageTime>& stages);

} // namespace penumbra::server
