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

// What went wrong, where, and what was expected. `what()` is one line: the message, then the hint in brackets.
class PENUMBRA_API Error : public std::exception {
public:
    Error(ErrorCode code, std::string message, std::string hint = {});

    ErrorCode code() const noexcept { return code_; }
    const std::string& message() const noexcept { return message_; }
    const std::string& hint() const noexcept { return hint_; }
    const char* what() const noexcept override { return what_.c_str(); }

    // The same error, found inside `where` ("scene.json", "receivers.depth"): the message gets it as a prefix.
    Error within(std::string_view where) const;

private:
    ErrorCode code_;
    std::string message_, hint_, what_;
};

// How a code leaves the program; both come from one table.
PENUMBRA_API std::string_view name(ErrorCode code);
PENUMBRA_API int exit_code(ErrorCode code);   // 1 the work failed, 2 wrong usage or input
PENUMBRA_API int http_status(ErrorCode code); // 400 to 500

} // namespace penumbra
