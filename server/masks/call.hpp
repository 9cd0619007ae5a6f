// What the service asks of a worker, and what comes back: JSON over a channel, bytes beside it in shared memory.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "masks/mask_choice.hpp"
#include "masks/masks.hpp"
#include "process/problem.hpp"

namespace penumbra::server {

// Files beside it: the body; of a kept scene's mask the scene's body, then the patch, if any.
struct Call {
    enum class Kind {
        warm, // check the device and launch every technique
        mask, // of the scene in the body
        keep, // the scene in the body
        depth, // of the receivers of the scene in the body (depth_view.hpp)
        kept  // a mask of a kept scene
    };
    Kind kind = Kind::mask;
    std::string form = {};       // the body's boundary
    std::string id = {};         // of the scene
    std::string patch_form = {}; // the patch's boundary; empty: it is JSON
    MaskChoice choice = {};
    std::string format = {}; // MaskFormat::format
    int side = 0;            // of a depth view
    double seconds = 0;      // that the request has left
};

// What a scene that is kept takes, in the worker that keeps it.
struct SceneFacts {
    std::uint64_t bytes = 0, device_bytes = 0;
    std::vector<std::string> warnings = {};
};

// At the begin of the file beside it: `bytes` of the mask, or of the depth view.
struct CallReply {
    std::uint64_t bytes = 0;
    std::optional<Problem> problem = {};
    std::string inside = {}; // of the problem, for the log alone
    MaskReply reply = {};    // its bytes are the file's
    double decode_ms = 0;
    std::optional<SceneFacts> scene = {};
    int width = 0, height = 0; // of the receivers, with a depth view
    bool spent = false;        // the worker holds on to much memory: another one should take its place
};

// Who a worker is: its first message.
struct Greeting {
    std::string problem = {};                 // why it cannot work
    int code = 0;                             // of the error: ErrorCode
    std::string device, driver, devices_json; // as GET /v1/devices has them
    std::vector<std::string> warnings = {};
    std::vector<std::string> closed = {}; // what the kernel keeps from it
    std::uint64_t memory = 0;             // bytes that it may take
    std::string kernels = {};             // the folder where PoCL keeps its own
};

// Texts are cut where they would be longer than a message.
std::string text_of(const Call& call);
std::string text_of(const CallReply& answer);
std::string text_of(const Greeting& greeting);
Call call_from(std::string_view text);
CallReply reply_from(std::string_view text);
Greeting greeting_from(std::string_view text);

} // namespace penumbra::server
