#include "process/problem.hpp"

#include <nlohmann/json.hpp>

namespace penumbra::server {

Problem::Problem(int status_, std::string reason_, std::string detail_, int retry_after_s_)
    : status(status_), reason(std::move(reason_)), detail(std::move(detail_)), retry_after_s(retry_after_s_)
{
}

Problem problem_from(const Error& error)
{
    const int status = http_status(error.code());
    const std::string reason(name(error.code()));
    switch (error.code()) {
    case ErrorCode::device:
        return Problem(status, reason, "the device failed", 10);
    case ErrorCode::output:
    case ErrorCode::internal:
        return Problem(status, reason, "the request failed inside the service; its log has the reason under the request's id");
    default: {
        Problem problem(status, reason, error.what());
        problem.path = error.path();
        return problem;
    }
    }
}

Problem defect() { return problem_from(Error(ErrorCode::internal, {})); }

Problem out_of_memory() { return Problem(503, "memory", "this takes more memory than there is now; send less, or try again", 5); }

Problem out_of_memory(std::uint64_t bytes)
{
    return Problem(413, "memory",
                   "this takes more memory than the " + std::to_string(bytes >> 20) +
                       " MiB that a request may use; send smaller images, or fewer");
}

Problem service_ends() { return Problem(503, "ending", "the service is about to end, and this takes longer than it waits; try again", 5); }

std::string_view title_of(int status)
{
    switch (status) {
    case 400:
        return "Bad Request";
    case 401:
        return "Unauthorized";
    case 404:
        return "Not Found";
    case 405:
        return "Method Not Allowed";
    case 406:
        return "Not Acceptable";
    case 408:
        return "Request Timeout";
    case 411:
        return "Length Required";
    case 413:
        return "Content Too Large";
    case 414:
        return "URI Too Long";
    case 415:
        return "Unsupported Media Type";
    case 416:
        return "Range Not Satisfiable";
    case 422:
        return "Unprocessable Content";
    case 431:
        return "Request Header Fields Too Large";
    case 503:
        return "Service Unavailable";
    case 504:
        return "Gateway Timeout";
    default:
        return status < 500 ? "Bad Request" : "Internal Server Error";
    }
}

std::string json_of(const Problem& problem, std::string_view request_id)
{
    nlohmann::ordered_json json = {{"type", "about:blank"},
                                   {"title", title_of(problem.status)},
                                   {"status", problem.status},
                                   {"detail", problem.detail},
                                   {"reason", problem.reason}};
    if (!problem.path.empty()) json["path"] = problem.path;
    if (problem.retry_after_s > 0) json["retry_after"] = problem.retry_after_s;
    if (!request_id.empty()) json["request_id"] = request_id;
    return json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "\n";
}

} // namespace penumbra::server
