#include <penumbra/error.hpp>

#include <array>
#include <cstddef>
#include <initializer_list>
#include <utility>

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

// The parts that are there, in order.
std::string joined(std::initializer_list<std::string_view> parts)
{
    std::string line;
    for (const std::string_view part : parts)
        if (!part.empty()) line += (line.empty() ? "" : ": ") + std::string(part);
    return line;
}

} // namespace

Error::Error(ErrorCode code, std::string place, std::string path, std::string message, std::string hint)
    : code_(code), place_(std::move(place)), path_(std::move(path)), message_(std::move(message)), hint_(std::move(hint)),
      what_(joined({place_, path_, message_}) + (hint_.empty() ? "" : " (" + hint_ + ")"))
{
}

Error::Error(ErrorCode code, std::string message, std::string hint) : Error(code, {}, {}, std::move(message), std::move(hint)) {}

Error Error::at(ErrorCode code, std::string path, std::string message, std::string hint)
{
    return {code, {}, std::move(path), std::move(message), std::move(hint)};
}

Error Error::within(std::string_view where) const
{
    const bool there = place_.starts_with(where) && (place_.size() == where.size() || place_.substr(where.size()).starts_with(": "));
    return {code_, there ? place_ : joined({where, place_}), path_, message_, hint_};
}

Error Error::under(std::string_view key) const
{
    const bool dotted = !key.empty() && !path_.empty() && !path_.starts_with('[');
    return {code_, {}, std::string(key) + (dotted ? "." : "") + path_, joined({place_, message_}), hint_};
}

Error Error::with_path(std::string path) const { return {code_, place_, std::move(path), message_, hint_}; }

std::string_view name(ErrorCode code) { return row(code).name; }

int exit_code(ErrorCode code) { return row(code).exit_code; }

int http_status(ErrorCode code) { return row(code).http_status; }

} // namespace penumbra
