// The one exception type of the library.
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include <penumbra/export.hpp>

namespace penumbra {

enum class ErrorCode {
    usage,         // a wrong call: command line, arguments that do not fit together
    invalid_input, // a scene, image or mesh that cannot be used as it is
    not_found,     // a file or a part that is named but not there
    unsupported,   // valid, but not something this technique or build can do
    too_large,     // over a limit of the program or of the device
    device,        // no device, or the device failed
    output,        // a result could not be written
    internal,      // a defect of ours
};

// What went wrong, where, and what was expected, each apart; whoever prints joins them. `what()` is that line:
//
//   scene.json: lights[1].half_v: is missing (expected a half-edge)
//   place       path              message     hint
class PENUMBRA_API Error : public std::exception {
public:
    Error(ErrorCode code, std::string message, std::string hint = {});

    // About the value at `path` of a scene ("lights[1].half_u", "receivers.depth").
    static Error at(ErrorCode code, std::string path, std::string message, std::string hint = {});

    ErrorCode code() const noexcept { return code_; }
    const std::string& place() const noexcept { return place_; }     // a file, a flag; empty: none
    const std::string& path() const noexcept { return path_; }       // in the scene; empty: about no single value of one
    const std::string& message() const noexcept { return message_; } // without the two above
    const std::string& hint() const noexcept { return hint_; }
    const char* what() const noexcept override { return what_.c_str(); }

    // The same error, found inside a file or under a flag: the place gets `where` in front, unless it stands there.
    Error within(std::string_view where) const;
    // The same error, found at a key of a scene: the path gets `key` in front. A place that it had was what the key names, and goes into
    // the message.
    Error under(std::string_view key) const;
    // The same error, about another value.
    Error with_path(std::string path) const;

private:
    Error(ErrorCode code, std::string place, std::string path, std::string message, std::string hint);

    ErrorCode code_;
    std::string place_, path_, message_, hint_, what_;
};

// How a code leaves the program; both come from one table.
PENUMBRA_API std::string_view name(ErrorCode code);
PENUMBRA_API int exit_code(ErrorCode code);   // 1 the work failed, 2 wrong usage or input
PENUMBRA_API int http_status(ErrorCode code); // 400 to 500

} // namespace penumbra
