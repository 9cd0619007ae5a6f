#include "service.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <optional>
#include <random>
#include <thread>

#include <sys/socket.h>

#include <nlohmann/json.hpp>

#include <penumbra/error.hpp>

#include "connection.hpp"
#include "describe.hpp"
#include "masks.hpp"
#include "multipart.hpp"
#include "problem.hpp"
#include "ready.hpp"

namespace penumbra::server {
namespace {

using httplib::Request;
using httplib::Response;

constexpr int backlog = 1024;                // connections that the kernel keeps for us; the HTTP library asks for 5
constexpr std::size_t max_connections = 512; // in the lobby; with threads and device files below the usual limit of 1024 descriptors

double seconds_since(Deadline::Clock::time_point begin) { return std::chrono::duration<double>(Deadline::Clock::now() - begin).count(); }

std::optional<std::uint64_t> length_from(const std::string& text)
{
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return {};
    return value;
}

bool is_request_id(std::string_view id)
{
    return !id.empty() && id.size() <= 128 && std::ranges::all_of(id, [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '_' || c == '-';
    });
}

std::string random_prefix()
{
    std::random_device random;
    char text[16];
    std::snprintf(text, sizeof(text), "%08x-", random());
    return text;
}

const Route* route_at(std::string_view path)
{
    const auto found = std::ranges::find(routes(), path, &Route::path);
    return found == routes().end() ? nullptr : &*found;
}

void answer(Response& response, const Problem& problem)
{
    Connection& connection = Connection::current();
    connection.reason = problem.reason;
    response.status = problem.status;
    if (problem.retry_after_s > 0) response.set_header("Retry-After", std::to_string(problem.retry_after_s));
    if (problem.status == 401) response.set_header("WWW-Authenticate", "Bearer");
    response.set_content(json_of(problem, connection.request_id), problem_type);
}

// Runs a handler; whatever it throws becomes an answer, and what must not get out goes to the log.
template <class Call> void guarded(Response& response, Call&& call)
{
    try {
        call();
    } catch (const Problem& problem) {
        answer(response, problem);
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

// A JSON array in ASCII that fits into a header; what does not fit is left out.
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

} // namespace

bool same_secret(std::string_view given, std::string_view expected)
{
    unsigned difference = given.size() != expected.size();
    for (std::size_t i = 0; i < given.size(); ++i)
        difference |=
            static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(expected[i % std::max<std::size_t>(expected.size(), 1)]);
    return difference == 0;
}

// The HTTP library, with connections of our own (connection.hpp).
class Service::Http final : public httplib::Server {
public:
    explicit Http(Service& service) : service_(service)
    {
        new_task_queue = [this] { return new Reception(*this); };
        set_payload_max_length(static_cast<std::size_t>(service.options_.body_bytes));
        // Not SO_REUSEPORT, with which a second server would take half of the connections.
        set_socket_options([](socket_t socket) {
            const int on = 1;
            setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
        });
    }

    void lengthen_backlog() { ::listen(svr_sock_, backlog); }

private:
    // Between the library's accepting thread and the threads that answer: the lobby.
    class Reception final : public httplib::TaskQueue {
    public:
        explicit Reception(Http& http)
            : threads_(static_cast<std::size_t>(http.service_.options_.io_threads)),
              lobby_(max_connections, std::chrono::seconds(http.service_.options_.header_s), [this, &http](Arrival arrival) {
                  threads_.enqueue([this, &http, arrival = std::move(arrival)]() mutable { http.serve(lobby_, std::move(arrival)); });
              })
        {
            http.lobby_ = &lobby_;
        }
        void enqueue(std::function<void()> accepted) override { accepted(); }
        void shutdown() override
        {
            lobby_.wait_for_arrivals();
            threads_.shutdown(); // when all is answered
            lobby_.wait_for_leaving();
        }

    private:
        httplib::ThreadPool threads_;
        Lobby lobby_;
    };

    bool process_and_close_socket(socket_t socket) override
    {
        lobby_->arrive(socket);
        return true;
    }

    void serve(Lobby& lobby, Arrival arrival)
    {
        const Deadline deadline(std::chrono::seconds(service_.options_.deadline_s), arrival.begun);
        Connection connection(lobby, std::move(arrival), deadline);
        bool closed = false;
        process_request(connection, true, closed, [&](Request& request) { begin(request, connection); });
    }

    // After the headers are read, before anything is decided.
    void begin(Request& request, Connection& connection)
    {
        connection.begin_body(length_from(request.get_header_value("Content-Length")).value_or(0));
        const std::string given = request.get_header_value("X-Request-Id");
        connection.request_id = is_request_id(given) ? given : service_.id_prefix_ + std::to_string(++service_.requests_);
        // What the library would act on by itself: its multipart reader is quadratic in a header line's length, ranges it applies to any
        // answer, bodies it compresses at will, and its REMOTE_ADDR may be the client's.
        connection.content_type = request.get_header_value("Content-Type");
        for (const char* name : {"Content-Type", "Range", "Accept-Encoding", "REMOTE_ADDR"}) request.headers.erase(name);
        request.ranges.clear();
    }

    Service& service_;
    Lobby* lobby_ = nullptr; // while it serves
};

Service::Service(Options options, Engine engine, Log log)
    : options_(std::move(options)), engine_(std::move(engine)), log_(std::move(log)),
      gate_(static_cast<std::size_t>(options_.slots), static_cast<std::size_t>(options_.queue)), techniques_(techniques_json()),
      devices_(devices_json(list_devices(), engine_.device().index)), openapi_(openapi_json(options_)), id_prefix_(random_prefix()),
      started_s_(std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count()),
      http_(std::make_unique<Http>(*this))
{
    set_routes();
}

Service::~Service() = default;

int Service::bind()
{
    const int wanted = static_cast<int>(options_.port);
    const int port = wanted == 0 ? http_->bind_to_any_port(options_.host) : (http_->bind_to_port(options_.host, wanted) ? wanted : -1);
    if (port < 0)
        throw Error(ErrorCode::usage, "--host, --port: cannot listen on " + options_.host + " port " + std::to_string(wanted),
                    "expected an address of this machine and a port that nobody has");
    http_->lengthen_backlog();
    return port;
}

void Service::become_ready()
{
    check_known_mask(engine_);
    warm(engine_);
    warm_ = true;
}

void Service::serve()
{
    if (!stopped_) http_->listen_after_bind();
}

void Service::drain() { draining_ = true; }

void Service::stop()
{
    draining_ = true;
    stopped_ = true;
    http_->stop();
}

void Service::check(const Request& request) const
{
    const Route* route = route_at(request.path);
    if (!route) throw Problem(404, "no_route", "there is nothing at this path; /openapi.json lists what there is");
    const std::string_view method = request.method == "HEAD" ? "GET" : std::string_view(request.method);
    if (method != route->method) throw Problem(405, "method", std::string(route->path) + ": expected " + std::string(route->method));
    if (!options_.token.empty() && !route->open) {
        const std::string given = request.get_header_value("Authorization");
        if (!given.starts_with("Bearer ") || !same_secret(std::string_view(given).substr(7), options_.token))
            throw Problem(401, "token", "expected the header Authorization: Bearer TOKEN with the service's token");
    }
    if (route->method != "POST") return;
    check_body_headers(request);
    if (!warm_) throw Problem(503, "not_ready", "the service is still starting", 5);
    if (gate_.full()) throw Problem(503, "queue_full", "all places are taken; try again", 1);
}

void Service::check_body_headers(const Request& request) const
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
    boundary_of(Connection::current().content_type);
    negotiate(request.get_header_value("Accept"));
}

void Service::post_mask(const Request& request, Response& response, const httplib::ContentReader& reader)
{
    Connection& connection = Connection::current();
    const auto admitted = gate_.admit();
    const MaskFormat& format = negotiate(request.get_header_value("Accept"));
    const std::string boundary = boundary_of(connection.content_type);

    // The body, whole, never more than announced and allowed. What is reserved costs nothing before it is written to.
    const auto uploading = Deadline::Clock::now();
    std::string body;
    const std::size_t length = static_cast<std::size_t>(length_from(request.get_header_value("Content-Length")).value_or(0));
    body.reserve(length);
    const bool whole = reader([&](const char* data, std::size_t size) {
        if (size > length - body.size()) return false;
        body.append(data, size);
        return true;
    });
    if (connection.too_slow())
        throw Problem(408, "slow_body",
                      "the body came at less than " + std::to_string(slowest_transfer) + " bytes a second, " +
                          std::to_string(transfer_grace.count()) + " s after its begin");
    if (connection.timed_out())
        throw Problem(408, "slow_body", "the body did not come within " + std::to_string(options_.deadline_s) + " s of the connection");
    if (!whole || body.size() != length)
        throw Problem(400, "short_body",
                      "the body ended after " + std::to_string(body.size()) + " of " + std::to_string(length) + " bytes");
    const std::vector<Part> parts = parse_multipart(body, boundary, static_cast<std::size_t>(options_.parts));
    const double upload_s = seconds_since(uploading);

    const auto waiting = Deadline::Clock::now();
    std::optional<Gate::Guard> slot(gate_.enter(connection.request()));
    const double wait_s = seconds_since(waiting);
    MaskReply reply = compute_mask(engine_, parts, format, options_, connection.request());
    slot.reset();

    metrics_.observe("penumbra_upload_seconds", "", upload_s);
    metrics_.observe("penumbra_queue_wait_seconds", "", wait_s);
    metrics_.observe("penumbra_decode_seconds", "", reply.decode_ms / 1000);
    metrics_.observe("penumbra_compute_seconds", "technique=\"" + reply.technique + "\"", reply.compute_ms / 1000);
    metrics_.observe("penumbra_encode_seconds", "format=\"" + std::string(format.format) + "\"", reply.encode_ms / 1000);
    metrics_.count("penumbra_pixels_total", "", static_cast<double>(reply.pixels));

    reply.stages.insert(reply.stages.begin(), {{"upload", upload_s * 1000}, {"queue", wait_s * 1000}});
    response.status = 200;
    response.set_header("Server-Timing", server_timing(reply.stages));
    if (!reply.warnings.empty()) response.set_header("Penumbra-Warnings", warnings_header(reply.warnings));
    response.body = std::move(reply.bytes);
    response.set_header("Content-Type", std::string(format.media_type));
}

std::string Service::metrics_text() const
{
    const Gate::Counts counts = gate_.counts();
    std::string device;
    for (const char c : engine_.device().name) device += c == '"' || c == '\\' || c == '\n' ? ' ' : c;
    return metrics_.text({{"penumbra_requests_admitted", "", static_cast<double>(counts.admitted)},
                          {"penumbra_queue_depth", "", static_cast<double>(counts.waiting)},
                          {"penumbra_requests_computing", "", static_cast<double>(counts.computing)},
                          {"penumbra_ready", "", warm_ && !draining_ ? 1.0 : 0.0},
                          {"penumbra_build_info", "version=\"" + version() + "\",device=\"" + device + "\"", 1},
                          {"process_resident_memory_bytes", "", resident_bytes()},
                          {"process_start_time_seconds", "", started_s_}});
}

void Service::set_routes()
{
    http_->set_pre_routing_handler([this](const Request& request, Response& response) {
        bool refused = true;
        guarded(response, [&] {
            check(request);
            refused = false;
        });
        if (response.status == 405) response.set_header("Allow", route_at(request.path)->method == "GET" ? "GET, HEAD" : "POST");
        return refused ? httplib::Server::HandlerResponse::Handled : httplib::Server::HandlerResponse::Unhandled;
    });
    http_->set_expect_100_continue_handler([this](const Request& request, Response& response) {
        guarded(response, [&] {
            check(request);
            response.status = 100;
        });
        const int status = response.status;
        if (status == 100) response.status = -1;
        return status;
    });
    // Answers that the library gives by itself, before any of our handlers: they have no body yet.
    http_->set_error_handler([](const Request&, Response& response) {
        if (!response.body.empty()) return;
        const Connection& connection = Connection::current();
        if (connection.headers_too_large())
            answer(response, Problem(431, "header_bytes",
                                     "request line and headers have more than " + std::to_string(max_header_bytes) + " bytes, the limit"));
        else if (connection.timed_out())
            answer(response, Problem(408, "slow_headers", "the headers did not come in time"));
        else
            answer(response, Problem(response.status, "http", "this is no HTTP request that can be read"));
    });
    http_->set_exception_handler([](const Request&, Response& response, std::exception_ptr) { answer(response, defect()); });
    http_->set_logger([this](const Request& request, const Response& response) { finished(request, response); });
    http_->set_default_headers({{"X-Content-Type-Options", "nosniff"}, {"Cache-Control", "no-store"}});
    http_->set_post_routing_handler(
        [](const Request&, Response& response) { response.set_header("X-Request-Id", Connection::current().request_id); });

    const auto fixed = [](const std::string& text, const char* type) {
        return [&text, type](const Request&, Response& response) { response.set_content(text, type); };
    };
    http_->Get("/v1/techniques", fixed(techniques_, "application/json"));
    http_->Get("/v1/devices", fixed(devices_, "application/json"));
    http_->Get("/openapi.json", fixed(openapi_, "application/json"));
    http_->Get("/healthz", [](const Request&, Response& response) { response.set_content("alive\n", "text/plain"); });
    http_->Get("/readyz", [this](const Request&, Response& response) {
        if (draining_) return answer(response, Problem(503, "draining", "the service is about to end", 5));
        if (!warm_) return answer(response, Problem(503, "not_ready", "the service is still starting", 5));
        response.set_content("ready\n", "text/plain");
    });
    http_->Get("/metrics",
               [this](const Request&, Response& response) { response.set_content(metrics_text(), "text/plain; version=0.0.4"); });
    http_->Post("/v1/masks", [this](const Request& request, Response& response, const httplib::ContentReader& reader) {
        guarded(response, [&] { post_mask(request, response, reader); });
    });
}

void Service::finished(const Request& request, const Response& response)
{
    const Connection& connection = Connection::current();
    const Route* route = route_at(request.path);
    const std::string name(route ? route->path : "other");
    const double seconds = seconds_since(connection.begun);
    const bool known = request.method == "GET" || request.method == "HEAD" || request.method == "POST";
    const std::string method = known ? request.method : "other";
    metrics_.count("http_requests_total",
                   "method=\"" + method + "\",route=\"" + name + "\",code=\"" + std::to_string(response.status) + "\"");
    metrics_.observe("http_request_duration_seconds", "route=\"" + name + "\"", seconds);
    if (!connection.reason.empty()) metrics_.count("penumbra_rejected_total", "reason=\"" + connection.reason + "\"");

    nlohmann::ordered_json line = {{"request_id", connection.request_id}, {"method", method},     {"route", name},
                                   {"status", response.status},           {"ms", seconds * 1000}, {"bytes", response.body.size()}};
    if (!connection.reason.empty()) line["reason"] = connection.reason;
    if (!connection.inside.empty() && response.status >= 500) line["inside"] = connection.inside;
    log_(line.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
}

} // namespace penumbra::server
