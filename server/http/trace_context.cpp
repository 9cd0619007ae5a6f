#include "http/trace_context.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <random>

namespace penumbra::server {
namespace {

bool is_hex(std::string_view text)
{
    return std::ranges::all_of(text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool is_zero(std::string_view text)
{
    return std::ranges::all_of(text, [](char c) { return c == '0'; });
}

} // namespace

std::optional<TraceContext> trace_context_from(std::string_view header)
{
    // version "-" trace-id "-" parent-id "-" flags; later versions may go on after another "-".
    constexpr std::size_t length = 55;
    if (header.size() < length || header[2] != '-' || header[35] != '-' || header[52] != '-') return {};
    const std::string_view version = header.substr(0, 2), trace = header.substr(3, 32), parent = header.substr(36, 16),
                           flags = header.substr(53, 2);
    if (!is_hex(version) || !is_hex(trace) || !is_hex(parent) || !is_hex(flags)) return {};
    if (version == "ff" || is_zero(trace) || is_zero(parent)) return {};
    if (header.size() > length && (version == "00" || header[length] != '-')) return {};
    return TraceContext{std::string(trace), std::string(parent), std::string(flags)};
}

std::string traceparent_of(const TraceContext& context, std::string_view span_id)
{
    return "00-" + context.trace_id + "-" + std::string(span_id) + "-" + context.flags;
}

std::string new_span_id()
{
    thread_local std::mt19937_64 random(std::random_device{}());
    std::uint64_t value = 0;
    while (value == 0) value = random();
    char text[17];
    std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(value));
    return text;
}

} // namespace penumbra::server
