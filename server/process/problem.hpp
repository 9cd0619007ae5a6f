// Errors as the caller of the service sees them: application/problem+json (RFC 9457).
#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <string_view>

#include <penumbra/error.hpp>

namespace penumbra::server {

// Thrown by whatever refuses a request. `reason` is a label of few values, for metrics; `detail` names the part or key and what was
// expected.
struct Problem : std::exception {
    Problem(int status_, std::string reason_, std::string detail_, int retry_after_s_ = 0);

    int status;
    std::string reason, detail;
    std::string path;  // of the value in the scene that it is about; empty: of none
    int retry_after_s; // 0: trying again does not help
    const char* what() const noexcept override { return detail.c_str(); }
};

// The library's error; what is inside of us (device, output, internal) gets an outside text. `error.what()` belongs into the log.
Problem problem_from(const Error& error);

// Any other exception: its text says nothing to the outside.
Problem defect();

// std::bad_alloc: 503 of the service itself, which may have more later; 413 of a worker, which has `bytes` and no more.
Problem out_of_memory();
Problem out_of_memory(std::uint64_t bytes);

// What was under way when the service was told to end.
Problem service_ends();

std::string_view title_of(int status);
std::string json_of(const Problem& problem, std::string_view request_id);

constexpr const char* problem_type = "application/problem+json";

} // namespace penumbra::server
