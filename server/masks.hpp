// POST /v1/masks without the sockets: from the parts of a request to the bytes of a mask.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <penumbra/engine.hpp>

#include "gate.hpp"
#include "multipart.hpp"
#include "options.hpp"

namespace penumbra::server {

// A format that masks are sent in.
struct MaskFormat {
    std::string_view media_type, format; // `format` as in OutputFormat
};
std::span<const MaskFormat> mask_formats(); // the first is the default

// By the Accept header (RFC 9110, 12.5.1); of equal weights the first format of mask_formats(). Throws Problem 406.
const MaskFormat& negotiate(std::string_view accept);

struct StageTime {
    std::string name;
    double ms;
};

struct MaskReply {
    std::string bytes;
    std::string technique;
    std::uint64_t pixels = 0;
    std::vector<StageTime> stages; // decode, those of the report, encode
    double decode_ms = 0, compute_ms = 0, encode_ms = 0;
    std::vector<std::string> warnings;
};

// Computes the mask of part `scene`. The deadline is checked between stages. `format`: what negotiate gave; bits are those of the scene's
// output when that names the same format. Throws Error and Problem.
MaskReply compute_mask(const Engine& engine, std::span<const Part> parts, const MaskFormat& format, const Options& options,
                       const Deadline& deadline);

// Throws too_large for a scene that is more work than the options allow, naming the key and the limit.
void check_work(const Scene& scene, const Options& options);

// "decode;dur=1.250, shade;dur=3.100"
std::string server_timing(const std::vector<StageTime>& stages);

} // namespace penumbra::server
