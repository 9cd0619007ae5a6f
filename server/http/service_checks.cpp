// What is refused before a body is read, in order of cost.
#include <algorithm>

#include "http/browser_guard.hpp"
#include "masks/multipart.hpp"
#include "http/route.hpp"
#include "http/service_http.hpp"
#include "masks/mask_format.hpp"
#include "process/problem.hpp"

namespace penumbra::server {
namespace {

constexpr std::string_view scenes_prefix = "/v1/scenes/";

} // namespace

bool same_secret(std::string_view given, std::string_view expected)
{
    unsigned difference = given.size() != expected.size();
    for (std::size_t i = 0; i < given.size(); ++i)
        difference |=
            static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(expected[i % std::max<std::size_t>(expected.size(), 1)]);
    return difference == 0;
}

void Service::check(const Request& request) const
{
    check_browser(request);
    const Route* route = route_at(request.path, request.method);
    if (!route && request.path.starts_with("/page/") && (request.method == "GET" || request.method == "HEAD"))
        return; // the page's assets, or 404
    if (!route && request.path.starts_with(scenes_prefix))
        throw Problem(404, "no_scene", "there is no scene of this id: expected /v1/scenes/ and the 64 digits that POST /v1/scenes gave");
    if (!route) throw Problem(404, "no_route", "there is nothing at this path; /openapi.json lists what there is");
    const std::string_view method = request.method == "HEAD" ? "GET" : std::string_view(request.method);
    if (method != route->method) throw Problem(405, "method", std::string(route->path) + ": expected " + std::string(route->method));
    if (!route->open) check_token(request);
    if (route->method != "POST") return;
    check_body_headers(request, *route);
    if (!warm_) throw Problem(503, "not_ready", "the service is still starting", 5);
    if (gate_.full()) throw Problem(503, "queue_full", "all places are taken; try again", 1);
}

void Service::check_browser(const Request& request) const
{
    const std::size_t hosts = request.get_header_value_count("Host");
    const std::string host = request.get_header_value("Host");
    if (hosts > 1) throw Problem(400, "host", "Host: expected once");
    if (hosts == 1 && !is_known_host(host, options_.names))
        throw Problem(403, "host", "Host: is no name of this service; expected an IP address, localhost, or a name that --names lists");
    if (!is_own_origin(request.get_header_value("Origin"), host, options_.origins))
        throw Problem(403, "origin", "Origin: is another site's; expected the service's own, or one that --origins lists");
}

void Service::check_token(const Request& request) const
{
    if (options_.token.empty()) return;
    const std::string given = request.get_header_value("Authorization");
    if (!given.starts_with("Bearer ") || !same_secret(std::string_view(given).substr(7), options_.token))
        throw Problem(401, "token", "expected the header Authorization: Bearer TOKEN with the service's token");
}

void Service::check_body_headers(const Request& request, const Route& route) const
{
    const std::string encoding = request.get_header_value("Content-Encoding");
    if (!encoding.empty() && encoding != "identity")
        throw Problem(415, "encoding", "Content-Encoding: expected identity, the body as it is");
    const std::size_t lengths = request.get_header_value_count("Content-Length");
    if (lengths == 0 || request.has_header("Transfer-Encoding"))
        throw Problem(411, "length", "expected Content-Length and no Transfer-Encoding");
    const auto length = length_from(request.get_header_value("Content-Length"));
    if (lengths > 1 || !length) throw Problem(400, "length", "Content-Length: expected one number of bytes");
    if (*length > static_cast<std::uint64_t>(options_.body_bytes))
        throw Problem(413, "body_bytes",
                      "the body has " + std::to_string(*length) + " bytes; the limit is " + std::to_string(options_.body_bytes));
    // A patch may come as bare JSON; whatever else comes is a form.
    const bool patch = route.path.ends_with("{id}/masks");
    const std::string& type = Connection::current().content_type;
    if (patch && (*length == 0 || is_json(type))) {
        if (*length > static_cast<std::uint64_t>(options_.scene_bytes))
            throw Problem(413, "scene_bytes",
                          "the patch has " + std::to_string(*length) + " bytes; the limit is " + std::to_string(options_.scene_bytes));
    } else {
        boundary_of(type);
    }
    if (route.answer == Answer::mask) negotiate(request.get_header_value("Accept"), choice_of(request).image);
}

} // namespace penumbra::server
