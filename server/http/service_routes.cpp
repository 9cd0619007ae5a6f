// Routes, metrics and the log line.
#include <memory>

#include <nlohmann/json.hpp>

#include <penumbra/describe.hpp>

#include "http/answer.hpp"
#include "http/describe.hpp"
#include "http/page.hpp"
#include "http/route.hpp"
#include "http/service_http.hpp"

namespace penumbra::server {
namespace {

// Nothing but what the service itself serves: no inline script, no other host.
constexpr const char* page_policy = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
                                    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

// Answers that the library gives by itself, before any of our handlers: they have no body yet.
void answer_for_library(httplib::Response& response, const Options& options)
{
    if (!response.body.empty() || response.status < 400) return;
    const Connection& connection = Connection::current();
    if (connection.headers_too_large())
        answer(response, Problem(431, "header_bytes",
                                 "request line and headers have more than " + std::to_string(options.header_bytes) + " bytes, the limit"));
    else if (connection.timed_out())
        answer(response, Problem(408, "slow_headers", "the headers did not come in time"));
    else
        answer(response, Problem(response.status, "http", "this is no HTTP request that can be read"));
}

} // namespace

void Service::set_routes()
{
    http_->set_pre_routing_handler([this](const Request& request, Response& response) {
        bool refused = true;
        guarded(response, [&] {
            check(request);
            refused = false;
        });
        if (response.status == 405) response.set_header("Allow", allowed_methods(request.path));
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
    http_->set_error_handler([this](const Request&, Response& response) { answer_for_library(response, options_); });
    http_->set_exception_handler([](const Request&, Response& response, const std::exception_ptr&) { answer(response, defect()); });
    http_->set_logger([this](const Request& request, const Response& response) { finished(request, response); });
    http_->set_post_routing_handler([](const Request&, Response& response) {
        const Connection& connection = Connection::current();
        response.set_header("X-Content-Type-Options", "nosniff");
        response.set_header("X-Request-Id", connection.request_id);
        if (connection.trace) response.set_header("traceparent", traceparent_of(*connection.trace, connection.span_id));
        // A tag names what was asked for, not an error.
        if (response.status >= 400) {
            response.headers.erase("ETag");
            response.headers.erase("Cache-Control");
        }
        if (!response.has_header("Cache-Control")) response.set_header("Cache-Control", "no-store");
    });

    // With a reader in its signature, so that the library leaves the body to read_body().
    using Handler = void (Service::*)(const Request&, Response&);
    const auto post = [this](const char* path, Handler handler) {
        http_->Post(path, [this, handler](const Request& request, Response& response, const httplib::ContentReader&) {
            guarded(response, [&] { (this->*handler)(request, response); });
        });
    };
    post("/v1/masks", &Service::post_mask);
    post("/v1/scenes", &Service::post_scene);
    post("/v1/depth", &Service::post_depth);
    post("/v1/scenes/[0-9a-f]{64}/masks", &Service::post_kept_mask);
    const char* const scene = "/v1/scenes/[0-9a-f]{64}";
    http_->Get(scene, [this](const Request& request, Response& response) { guarded(response, [&] { get_scene(request, response); }); });
    http_->Delete(scene,
                  [this](const Request& request, Response& response) { guarded(response, [&] { delete_scene(request, response); }); });
    http_->Get("/healthz", [](const Request&, Response& response) { response.set_content("alive\n", "text/plain"); });
    http_->Get("/readyz", [this](const Request&, Response& response) { ready(response); });
    http_->Get("/metrics",
               [this](const Request&, Response& response) { response.set_content(metrics_text(), "text/plain; version=0.0.4"); });
}

void Service::set_documents()
{
    const auto serve_document = [this](const std::string& path, std::string bytes, std::string type) {
        const bool html = type.starts_with("text/html");
        const auto document = std::make_shared<const Document>(std::move(bytes), std::move(type));
        http_->Get(path, [document, html](const Request& request, Response& response) {
            if (html) response.set_header("Content-Security-Policy", page_policy);
            document->answer(request, response);
        });
    };
    serve_document("/v1/techniques", techniques_json(), "application/json");
    serve_document("/v1/devices", greeting_.devices_json, "application/json");
    serve_document("/openapi.json", openapi_json(options_), "application/json");
    for (const Asset& asset : page_assets())
        serve_document(literal_pattern(asset.path), std::string(asset.bytes), std::string(asset.media_type));
}

void Service::ready(Response& response) const
{
    if (draining_) return answer(response, Problem(503, "draining", "the service is about to end", 5));
    if (!warm_) return answer(response, Problem(503, "not_ready", "the service is still starting", 5));
    if (!works()) return answer(response, Problem(503, "no_worker", "no worker is free, and none has finished for as long as a request may take", 5));
    response.set_content("ready\n", "text/plain");
}

std::string Service::metrics_text()
{
    const Gate::Counts counts = gate_.counts();
    const WorkerPool::Counts workers = pool_.counts();
    const auto kept = scenes_.counts();
    std::string device;
    for (const char c : greeting_.device) device += c == '"' || c == '\\' || c == '\n' ? ' ' : c;
    return metrics_.text({{"penumbra_requests_admitted", "", static_cast<double>(counts.admitted)},
                          {"penumbra_queue_depth", "", static_cast<double>(counts.waiting)},
                          {"penumbra_requests_computing", "", static_cast<double>(counts.computing)},
                          {"penumbra_ready", "", warm_ && !draining_ && works() ? 1.0 : 0.0},
                          {"penumbra_workers", "state=\"starting\"", static_cast<double>(workers.starting)},
                          {"penumbra_workers", "state=\"idle\"", static_cast<double>(workers.idle)},
                          {"penumbra_workers", "state=\"busy\"", static_cast<double>(workers.busy)},
                          {"penumbra_workers_started_total", "", static_cast<double>(workers.started)},
                          {"penumbra_workers_crashed_total", "", static_cast<double>(workers.crashed)},
                          {"penumbra_workers_overdue_total", "", static_cast<double>(workers.overdue)},
                          {"penumbra_kept_scenes", "", static_cast<double>(kept.scenes)},
                          {"penumbra_kept_scene_bytes", "", static_cast<double>(kept.bytes)},
                          {"penumbra_kept_device_bytes", "", static_cast<double>(kept.device_bytes)},
                          {"penumbra_mask_device_bytes_max", "", static_cast<double>(peak_device_bytes_)},
                          {"penumbra_build_info", "version=\"" + version() + "\",device=\"" + device + "\"", 1},
                          {"process_resident_memory_bytes", "", resident_bytes()},
                          {"process_start_time_seconds", "", started_s_}});
}

void Service::finished(const Request& request, const Response& response)
{
    const Connection& connection = Connection::current();
    const RequestCost& cost = connection.cost;
    const Route* route = route_at(request.path, request.method);
    const bool page = request.path.starts_with("/page/") && response.status < 400;
    const std::string name(route ? route->path : page ? std::string_view("/page") : std::string_view("other"));
    const double seconds = seconds_since(connection.begun);
    const bool known = request.method == "GET" || request.method == "HEAD" || request.method == "POST" || request.method == "DELETE";
    const std::string method = known ? request.method : "other";
    metrics_.count("http_requests_total",
                   "method=\"" + method + "\",route=\"" + name + "\",code=\"" + std::to_string(response.status) + "\"");
    metrics_.observe("http_request_duration_seconds", "route=\"" + name + "\"", seconds);
    if (!connection.reason.empty()) metrics_.count("penumbra_rejected_total", "reason=\"" + connection.reason + "\"");

    nlohmann::ordered_json line = {{"request_id", connection.request_id}, {"method", method},     {"route", name},
                                   {"status", response.status},           {"ms", seconds * 1000}, {"bytes_in", cost.bytes_in},
                                   {"bytes_out", response.body.size()}};
    if (connection.trace)
        line.update(
            {{"trace_id", connection.trace->trace_id}, {"parent_id", connection.trace->parent_id}, {"span_id", connection.span_id}});
    if (!cost.technique.empty())
        line.update({{"technique", cost.technique},
                     {"upload_ms", cost.upload_ms},
                     {"queue_ms", cost.queue_ms},
                     {"decode_ms", cost.decode_ms},
                     {"compute_ms", cost.compute_ms},
                     {"encode_ms", cost.encode_ms},
                     {"worker_ms", cost.worker_ms}});
    if (!connection.reason.empty()) line["reason"] = connection.reason;
    if (!connection.inside.empty() && response.status >= 500) line["inside"] = connection.inside;
    log_(line.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
}

} // namespace penumbra::server
