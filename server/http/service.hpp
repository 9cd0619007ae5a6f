// The HTTP service: routes, refusals, readiness, and a graceful end.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "http/metrics.hpp"
#include "masks/call.hpp"
#include "masks/crashes.hpp"
#include "masks/kept_upload.hpp"
#include "masks/scene_store.hpp"
#include "process/gate.hpp"
#include "process/options.hpp"
#include "process/shared_bytes.hpp"
#include "process/worker_pool.hpp"

namespace httplib {
struct Request;
struct Response;
} // namespace httplib

namespace penumbra::server {

struct Route;

class Service {
public:
    using Log = std::function<void(std::string_view line)>; // called from many threads
    // Starts the first processes, of `program` (penumbra-server; by default this one). Throws what keeps it from its work: no device.
    Service(Options options, Log log, std::string program = "/proc/self/exe");
    ~Service();

    // Binds; gives the port. Throws usage when the address cannot be had.
    int bind();
    // Waits until a worker for each slot has checked the device and launched every technique; then /readyz says ready. Throws Problem.
    void become_ready();
    // Answers until stop(); returns when what was in flight is done or stopped.
    void serve();
    // From now on /readyz says 503.
    void drain();
    // What is computed, and getting ready, ends by itself soon or is stopped.
    void end_work();
    // Takes no more connections, and ends the work; serve() returns within a second. May be called from any thread, before serve() too.
    void stop();

    Gate& gate() { return gate_; }
    WorkerPool& workers() { return pool_; }
    const Greeting& greeting() const { return greeting_; } // of the first worker
    // A worker is free, or one has finished within the longest time that a request has.
    bool works() const;

private:
    class Http;
    using Request = httplib::Request;
    using Response = httplib::Response;

    // service_checks.cpp: throw Problem for what is refused before its body is read.
    void check(const Request& request) const;
    void check_browser(const Request& request) const;
    void check_token(const Request& request) const;
    void check_body_headers(const Request& request, const Route& route) const;

    // service_masks.cpp: what computes.
    SharedBytes read_body(const Request& request);
    Room::Hold room_for(std::size_t bytes);
    void post_mask(const Request& request, Response& response);
    void post_scene(const Request& request, Response& response);
    void post_depth(const Request& request, Response& response);
    void post_kept_mask(const Request& request, Response& response);
    void get_scene(const Request& request, Response& response);
    void delete_scene(const Request& request, Response& response);
    Gate::Slot enter_slot();
    // Has a worker do it. `digest` names the request where it ends its worker.
    template <class Digest>
    CallReply computed(Gate::Slot& slot, const Call& call, std::span<const int> files, const Digest& digest);
    void send_mask(Response& response, CallReply answer, const MaskFormat& format);
    std::string describe(const KeptUpload& scene);

    // service_routes.cpp
    void set_routes();
    void set_documents();
    void ready(Response& response) const;
    std::string metrics_text();
    void finished(const Request& request, const Response& response);

    const Options options_;
    const Log log_;
    Gate gate_;
    const bool own_kernels_; // of each worker
    WorkerPool pool_;
    const Greeting greeting_;
    const std::string device_; // and its driver, as masks depend on them
    Crashes crashes_;
    Room uploads_; // bodies and kept scenes
    StoreOf<KeptUpload> scenes_;
    mutable Metrics metrics_;
    const std::string id_prefix_;
    std::atomic<bool> warm_ = false, draining_ = false, stopped_ = false;
    std::atomic<std::uint64_t> requests_ = 0, peak_device_bytes_ = 0;
    const double started_s_;
    std::unique_ptr<Http> http_;
};

// Whether both are the same; takes as long for any `given` of one length.
bool same_secret(std::string_view given, std::string_view expected);

} // namespace penumbra::server
