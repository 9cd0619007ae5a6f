// penumbra mask --server: the same verb, computed by a service.
#pragma once

#include <string>
#include <vector>

#include <penumbra/image.hpp>

#include "mask_files.hpp"
#include "technique_flags.hpp"

namespace penumbra::cli {

struct RemoteScene {
    std::string server, scene; // URL, file
    TechniqueFlags technique;
    std::string over; // the file of the picture that previews are made of; empty: none
    Image picture;
};

// Sends the scene and the files that it names once for each mask and each bound, writes the answers as the service sent them, makes the
// previews here, prints the warnings. A mask's files are written when all that belongs to it is there. Returns
// the report's JSON: of the keys of a report those that an answer over HTTP has, and `server`, `request_id`, `round_trip_ms`; the
// resolution and device only where `with_report`; for more than one mask {"masks": [...]}, as reports_json. The token is
// PENUMBRA_SERVER_TOKEN's. Throws Error.
std::string masks_on_server(const RemoteScene& asked, const std::vector<MaskFile>& files, bool with_report);

} // namespace penumbra::cli
