#include "http/answer.hpp"

#include <nlohmann/json.hpp>

#include "masks/digest.hpp"
#include "masks/masks.hpp"

namespace penumbra::server {

void answer(httplib::Response& response, const Problem& problem)
{
    Connection& connection = Connection::current();
    connection.reason = problem.reason;
    response.status = problem.status;
    if (problem.retry_after_s > 0) response.set_header("Retry-After", std::to_string(problem.retry_after_s));
    if (problem.status == 401) response.set_header("WWW-Authenticate", "Bearer");
    response.set_content(json_of(problem, connection.request_id), problem_type);
}

Document::Document(std::string bytes, std::string media_type)
    : bytes_(std::move(bytes)), media_type_(std::move(media_type)), tag_("\"sha256-" + Digest().add(bytes_).hex() + "\"")
{
}

void Document::answer(const httplib::Request& request, httplib::Response& response) const
{
    response.set_header("ETag", tag_);
    response.set_header("Cache-Control", "no-cache"); // kept, but asked about each time
    if (names_tag(request.get_header_value("If-None-Match"), tag_)) {
        response.status = 304;
        return;
    }
    response.set_content(bytes_, media_type_);
}

std::string warnings_header(const std::vector<std::string>& warnings)
{
    constexpr std::size_t longest = 4096;
    nlohmann::json kept = nlohmann::json::array();
    std::string text;
    for (const std::string& warning : warnings) {
        kept.push_back(warning);
        const std::string longer = kept.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
        if (longer.size() > longest) break;
        text = longer;
    }
    return text;
}

} // namespace penumbra::server
