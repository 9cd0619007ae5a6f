// From the parts of a request to the bytes of a mask, without the sockets.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <penumbra/engine.hpp>
#include <penumbra/mask_job.hpp>

#include "masks/mask_cache.hpp"
#include "masks/mask_choice.hpp"
#include "masks/mask_format.hpp"
#include "masks/part.hpp"
#include "process/gate.hpp"
#include "process/options.hpp"

namespace penumbra::server {

// What a mask is computed from, decoded, and under which names its pieces are kept. Keys are texts that say all that a piece was made from;
// what has an empty one is not kept.
struct MaskTask {
    MaskJob job; // at the frame that was asked for
    OutputFormat output;

    struct LightKeys {
        std::string frame; // of the light in that frame
        std::string still; // of a light with a sequence: what all its frames share
    };
    MaskCache* cache = nullptr;
    std::vector<LightKeys> light_keys = {}; // of each of the job's lights
    std::string receivers_key = {};
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
    std::string error_estimate; // the header's value (Report::error_estimate); empty: there is none
};

// The part `scene`, or nothing when there is none. Throws Problem 413 when it is over the limit.
const Part* find_scene(std::span<const Part> parts, const Options& options);

// Parses part `scene` and loads what it names. Throws Error and Problem.
Scene decode_scene(std::span<const Part> parts, const Options& options, const Deadline& deadline);

// The lights of a job that are chosen, by their places in it (mask_choice.hpp), and one as it is in the frame that is.
std::vector<std::size_t> chosen_from(const std::vector<MaskLight>& lights, const MaskChoice& choice);
MaskLight at_choice(const MaskLight& light, const MaskChoice& choice);

// The task of a scene that came with its request.
MaskTask task_of(std::span<const Part> parts, const MaskChoice& choice, const Options& options, const Deadline& deadline);

// Prepares all the task's lights, for its cache. Throws Error and Problem.
void prepare_all(const Engine& engine, const MaskTask& task, const Deadline& deadline);

// The mask, or its bound where the task's job has that. Stopped at the deadline. `format`: what negotiate gave; bits of a
// mask are those of the scene's output when that names the same format. Throws Error and Problem.
MaskReply compute_mask(const Engine& engine, const MaskTask& task, const MaskFormat& format, const Options& options,
                       const Deadline& deadline);

// A strong entity tag, quotes and all. `content` names all that was sent (id_of, KeptScene::content_of); the mask depends on that, on which
// of the scene's it is, on the format, the program and the `device` with its driver.
std::string etag_of(std::string_view device, std::string_view content, const MaskChoice& choice, const MaskFormat& format);

// Whether an If-None-Match header names the tag (RFC 9110, 13.1.2; weak tags of the same text count).
bool names_tag(std::string_view header, std::string_view tag);

// "decode;dur=1.250, shade;dur=3.100"
std::string server_timing(const std::vector<StageTime>& stages);

} // namespace penumbra::server
