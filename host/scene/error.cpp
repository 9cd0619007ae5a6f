#include <penumbra/error.hpp>

#include <array>
#include <cstddef>

namespace penumbra {
namespace {

struct Row {
    ErrorCode code;
    std::string_view name;
    int exit_code;
    int http_status;
};

// In the order of the enumerators.
constexpr std::array rows{
    Row{ErrorCode::usage, "usage", 2, 400},         Row{ErrorCode::invalid_input, "invalid_input", 2, 422},
    Row{ErrorCode::not_found, "not_found", 2, 422}, Row{ErrorCode::unsupported, "unsupported", 2, 422},
    Row{ErrorCode::too_large, "too_large", 2, 413}, Row{ErrorCode::device, "device", 1, 503},
    Row{ErrorCode::output, "output", 1, 500},       Row{ErrorCode::internal, "internal", 1, 500},
};

const Row& row(ErrorCode code) { return rows.at(static_cast<std::size_t>(code)); }

} // namespace

Error::Error(ErrorCode code, std::string message, std::string hint)
    : code_(code), message_(std::move(message)), hint_(std::move(hint)), what_(hint_.empty() ? message_ : message_ + " (" + hint_ + ")")
{
}

Error Error::within(std::string_view where) const { return Error(code_, std::string(where) + ": " + message_, hint_); }

std::string_view name(ErrorCode code) { return row(code).name; }

int exit_code(ErrorCode code) { return row(code).exit_code; }

int http_status(ErrorCode code) { return row(code).http_status; }

} // namespace penumbra
