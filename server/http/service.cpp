#include "http/service.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <random>

#include <sys/socket.h>

#include <penumbra/error.hpp>

#include "http/connection.hpp"
#include "http/service_http.hpp"
#include "masks/worker.hpp"
#include "process/kernel_copies.hpp"
#include "process/memory.hpp"

namespace penumbra::server {
namespace {

// After the end was asked for: what is under way may end by itself, and answers may leave. Together below a second.
constexpr std::chrono::milliseconds grace{500}, goodbye{250};

constexpr int backlog = 1024; // connections that the kernel keeps for us; the HTTP library asks for 5

bool is_request_id(std::string_view id)
{
    return !id.empty() && id.size() <= 128 && std::ranges::all_of(id, [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '_' || c == '-';
    });
}

LobbyLimits limits_of(const Options& options)
{
    return {.connections = static_cast<std::size_t>(options.connections),
            .header_time = std::chrono::seconds(options.header_s),
            .header_bytes = static_cast<std::size_t>(options.header_bytes),
            .answer_bytes = answers_memory(options),
            .forget_bytes = static_cast<std::size_t>(options.body_bytes),
            .slowest_transfer = static_cast<std::uint64_t>(options.transfer_bytes_s)};
}

std::string random_prefix()
{
    std::random_device random;
    char text[16];
    std::snprintf(text, sizeof(text), "%08x-", random());
    return text;
}

void check_warm(const Message& message)
{
    const CallReply answer = reply_from(message.text);
    if (answer.problem) throw Error(ErrorCode::device, answer.inside.empty() ? answer.problem->detail : answer.inside);
}

// Whether there is a place where each worker may have copies of kernels.
bool has_place_for_kernels()
{
    std::error_code none;
    const auto folder = std::filesystem::temp_directory_path(none);
    return !none && may_hold_code(folder);
}

PoolOptions pool_of(const Options& options, std::string program, bool own_kernels)
{
    PoolOptions pool{.program = std::move(program),
                     .arguments = arguments_of(options),
                     .workers = static_cast<std::size_t>(options.slots) + spare_workers(options),
                     .warm = text_of(Call{.kind = Call::Kind::warm, .seconds = 3600}),
                     .warmed = check_warm};
    if (own_kernels)
        pool.furnish = [since = std::filesystem::file_time_type::clock::now() - std::chrono::seconds(1)](const std::string& folder, const std::string& greeting) {
            // A file system's clock is behind by a tick.
            if (!folder.empty()) copy_kernels(shared_folders(greeting_from(greeting).kernels), since, folders_in(own_cache(folder)));
        };
    return pool;
}

Greeting greeting_of(WorkerPool& pool, bool own_kernels)
{
    Greeting greeting = greeting_from(pool.start());
    if (!greeting.problem.empty()) throw Error(static_cast<ErrorCode>(greeting.code), greeting.problem);
    if (own_kernels) greeting.closed.emplace_back("kernels that others load (copies)");
    return greeting;
}

} // namespace

// Between the library's accepting thread and the threads that answer: the lobby.
class Service::Http::Reception final : public httplib::TaskQueue {
public:
    explicit Reception(Http& http)
        : threads_(static_cast<std::size_t>(http.service_.options_.io_threads)),
          lobby_(limits_of(http.service_.options_), [this, &http](Arrival arrival) {
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

Service::Http::Http(Service& service) : service_(service)
{
    new_task_queue = [this] { return new Reception(*this); };
    set_payload_max_length(static_cast<std::size_t>(service.options_.body_bytes));
    // Not SO_REUSEPORT, with which a second server would take half of the connections.
    set_socket_options([](socket_t socket) {
        const int on = 1;
        setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    });
}

void Service::Http::end_by(Deadline::Clock::time_point end)
{
    if (Lobby* const lobby = lobby_) lobby->end_by(end);
}

void Service::Http::lengthen_backlog() { ::listen(svr_sock_, backlog); }

bool Service::Http::process_and_close_socket(socket_t socket)
{
    lobby_.load()->arrive(socket);
    return true;
}

void Service::Http::serve(Lobby& lobby, Arrival arrival)
{
    const Deadline deadline(std::chrono::seconds(service_.options_.deadline_s), arrival.begun);
    Connection connection(lobby, std::move(arrival), deadline);
    connection.request_id = service_.id_prefix_ + std::to_string(++service_.requests_);
    bool closed = false;
    process_request(connection, true, closed, [&](httplib::Request& request) { begin(request, connection); });
}

void Service::Http::begin(httplib::Request& request, Connection& connection)
{
    // How long a chunked body is nobody knows: it is refused, and what comes of it forgotten.
    const bool chunked = request.has_header("Transfer-Encoding");
    connection.begin_body(chunked ? UINT64_MAX : length_from(request.get_header_value("Content-Length")).value_or(0));
    const std::string given = request.get_header_value("X-Request-Id");
    if (is_request_id(given)) connection.request_id = given;
    connection.trace = trace_context_from(request.get_header_value("traceparent"));
    if (connection.trace) connection.span_id = new_span_id();
    // What the library would act on by itself: its multipart reader is quadratic in a header line's length, ranges it applies to any
    // answer, bodies it compresses at will, and its REMOTE_ADDR may be the client's.
    connection.content_type = request.get_header_value("Content-Type");
    for (const char* name : {"Content-Type", "Range", "Accept-Encoding", "REMOTE_ADDR"}) request.headers.erase(name);
    request.ranges.clear();
}

Service::Service(Options options, Log log, std::string program)
    : options_(std::move(options)), log_(std::move(log)),
      gate_(static_cast<std::size_t>(options_.slots), static_cast<std::size_t>(options_.queue), spare_workers(options_)),
      own_kernels_(has_place_for_kernels()), pool_(pool_of(options_, std::move(program), own_kernels_), log_),
      greeting_(greeting_of(pool_, own_kernels_)),
      device_(greeting_.device + "\n" + greeting_.driver), uploads_(uploads_memory(options_)),
      scenes_(static_cast<std::uint64_t>(options_.scenes_bytes), static_cast<std::size_t>(options_.scenes),
              std::chrono::seconds(options_.scenes_s)),
      id_prefix_(random_prefix()), started_s_(std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count()),
      http_(std::make_unique<Http>(*this))
{
    set_routes();
    set_documents();
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
    pool_.wait_until_warm(static_cast<std::size_t>(options_.slots));
    warm_ = true;
}

bool Service::works() const
{
    const WorkerPool::Counts counts = pool_.counts();
    return counts.idle > 0 || counts.since_finished < std::chrono::seconds(options_.deadline_s);
}

void Service::serve()
{
    if (!stopped_) http_->listen_after_bind();
}

void Service::drain() { draining_ = true; }

void Service::end_work() { pool_.end_within(grace); }

void Service::stop()
{
    draining_ = true;
    stopped_ = true;
    end_work();
    http_->end_by(Deadline::Clock::now() + grace + goodbye);
    http_->stop();
}

} // namespace penumbra::server
