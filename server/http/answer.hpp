// Answers that handlers give: problems, and documents with an entity tag.
#pragma once

#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include <httplib.h>

#include <penumbra/error.hpp>
#include <penumbra/stop.hpp>

#include "http/connection.hpp"
#include "process/problem.hpp"

namespace penumbra::server {

void answer(httplib::Response& response, const Problem& problem);

// Runs a handler; whatever it throws becomes an answer, and what must not get out goes to the log.
template <class Call> void guarded(httplib::Response& response, Call&& call)
{
    try {
        call();
    } catch (const Problem& problem) {
        answer(response, problem);
    } catch (const Stopped&) {
        const Deadline& deadline = Connection::current().request();
        answer(response, deadline.passed() ? deadline.over() : service_ends());
    } catch (const Error& error) {
        Connection::current().inside = error.what();
        answer(response, problem_from(error));
    } catch (const std::exception& error) {
        Connection::current().inside = error.what();
        answer(response, defect());
    } catch (...) {
        answer(response, defect());
    }
}

// What does not change while the service runs.
class Document {
public:
    Document(std::string bytes, std::string media_type);
    // 304 without the bytes when the request has them already.
    void answer(const httplib::Request& request, httplib::Response& response) const;

private:
    std::string bytes_, media_type_, tag_;
};

// A JSON array in ASCII that fits into a header; what does not fit is left out.
std::string warnings_header(const std::vector<std::string>& warnings);

} // namespace penumbra::server
