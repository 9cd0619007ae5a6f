// W3C Trace Context (level 1): the trace that a request belongs to.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace penumbra::server {

struct TraceContext {
    std::string trace_id, parent_id, flags; // 32, 16 and 2 hexadecimal digits
};

// Nothing for a header that is not valid, which then is to be ignored.
std::optional<TraceContext> trace_context_from(std::string_view header);

// The header that names our own part of the trace.
std::string traceparent_of(const TraceContext& context, std::string_view span_id);

// 16 hexadecimal digits, not all zero.
std::string new_span_id();

} // namespace penumbra::server
