// The HTTP service: routes, refusals, readiness, and a graceful end.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <penumbra/engine.hpp>

#include "gate.hpp"
#include "metrics.hpp"
#include "options.hpp"

namespace httplib {
struct Request;
struct Response;
class ContentReader;
} // namespace httplib

namespace penumbra::server {

class Service {
public:
    using Log = std::function<void(std::string_view line)>; // called from many threads
    Service(Options options, Engine engine, Log log);
    ~Service();

    // Binds; gives the port. Throws usage when the address cannot be had.
    int bind();
    // Checks the device and warms every technique; then /readyz says ready. Throws what they throw.
    void become_ready();
    // Answers until stop(); returns when what was in flight is done.
    void serve();
    // From now on /readyz says 503.
    void drain();
    // Takes no more connections. May be called from any thread, before serve() too.
    void stop();

    Gate& gate() { return gate_; }

private:
    class Http;
    void set_routes();
    void check(const httplib::Request& request) const; // throws Problem for what is refused before its body is read
    void check_body_headers(const httplib::Request& request) const;
    void post_mask(const httplib::Request& request, httplib::Response& response, const httplib::ContentReader& reader);
    std::string metrics_text() const;
    void finished(const httplib::Request& request, const httplib::Response& response);

    const Options options_;
    const Engine engine_;
    const Log log_;
    Gate gate_;
    mutable Metrics metrics_;
    const std::string techniques_, devices_, openapi_, id_prefix_;
    std::atomic<bool> warm_ = false, draining_ = false, stopped_ = false;
    std::atomic<std::uint64_t> requests_ = 0;
    const double started_s_;
    std::unique_ptr<Http> http_;
};

// Whether both are the same; takes as long for any `given` of one length.
bool same_secret(std::string_view given, std::string_view expected);

} // namespace penumbra::server
