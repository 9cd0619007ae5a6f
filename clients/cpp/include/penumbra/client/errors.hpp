// What can go wrong between a client and the service. Arguments that are wrong before anything is sent are std::invalid_argument, files
// that cannot be read std::system_error.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace penumbra::client {

struct Problem {
    int status = 0;         // of HTTP; 0: there was no answer
    std::string detail;     // what went wrong, where, and what was expected
    std::string reason;     // one word, the service's or the client's own ("connect", "timeout", "broken_answer")
    std::string request_id; // in the service's log; empty: there was no answer
    std::optional<double> retry_after_s;
    std::string path = {}; // of the value in the scene that it is about ("light.half_u"); empty: it is about none
};

class Error : public std::runtime_error {
public:
    explicit Error(Problem problem)
        : std::runtime_error((problem.status == 0 ? std::string() : std::to_string(problem.status) + ": ") + problem.detail),
          problem_(std::move(problem))
    {
    }
    const Problem& problem() const noexcept { return problem_; }

private:
    Problem problem_;
};

struct BadRequest : Error { // any 4xx without a class of its own
    using Error::Error;
};
struct NotFound : BadRequest { // 404: no such path, or a kept scene that is forgotten (reason "no_scene")
    using BadRequest::BadRequest;
};
struct Unauthorized : Error { // 401
    using Error::Error;
};
struct TooLarge : Error { // 413: over one of the service's limits
    using Error::Error;
};
struct Unprocessable : Error { // 422: a scene or image that cannot be used; the detail names the key
    using Error::Error;
};
struct Overloaded : Error { // 503, still so after all retries
    using Error::Error;
};
struct DeadlineExceeded : Error { // 504 or 408, or the client's own timeout (status 0, reason "timeout")
    using Error::Error;
};
struct ServerError : Error { // any other status, and answers that are not what was asked for (reason "broken_answer")
    using Error::Error;
};
struct ConnectionFailed : Error { // no connection, or it broke before the whole answer was there
    using Error::Error;
};

// Throws the class that belongs to problem.status, which is no success.
[[noreturn]] inline void fail(Problem problem)
{
    switch (problem.status) {
    case 401:
        throw Unauthorized(std::move(problem));
    case 404:
        throw NotFound(std::move(problem));
    case 408:
    case 504:
        throw DeadlineExceeded(std::move(problem));
    case 413:
        throw TooLarge(std::move(problem));
    case 422:
        throw Unprocessable(std::move(problem));
    case 503:
        throw Overloaded(std::move(problem));
    default:
        if (problem.status >= 400 && problem.status < 500) throw BadRequest(std::move(problem));
        throw ServerError(std::move(problem));
    }
}

} // namespace penumbra::client
