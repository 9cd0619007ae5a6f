// penumbra mask --server: the same verb, computed by a service.
#pragma once

#include <string>

#include "technique_flags.hpp"

namespace penumbra::cli {

struct RemoteMask {
    std::string server, scene, mask; // URL, files
    TechniqueFlags technique;
};

// Sends the scene and the files that it names, writes the answer to `mask` as the service sent it, prints the warnings. Returns the
// report's JSON: of the contract's keys those that an answer over HTTP has, and `server`, `request_id`, `round_trip_ms`; the resolution and
// device only where `with_report`. The token is PENUMBRA_SERVER_TOKEN's. Throws Error.
std::string mask_on_server(const RemoteMask& asked, bool with_report);

} // namespace penumbra::cli
