// The calls that compute: masks of scenes that come along, and of scenes that are kept.
#include <algorithm>
#include <array>
#include <future>
#include <optional>

#include <nlohmann/json.hpp>

#include "http/answer.hpp"
#include "masks/multipart.hpp"
#include "http/service_http.hpp"
#include "masks/depth_view.hpp"
#include "masks/mask_format.hpp"
#include "masks/masks.hpp"

namespace penumbra::server {
namespace {

Problem no_scene()
{
    return Problem(404, "no_scene", "there is no scene of this id, or it is kept no longer; POST /v1/scenes keeps it again");
}

// The id in the path, which the checks have looked at.
std::string_view id_in(const httplib::Request& request)
{
    constexpr std::size_t before = sizeof("/v1/scenes/") - 1;
    return std::string_view(request.path).substr(before, 64);
}

// Four floats a pixel, and what files have beside: no worker makes more, whoever it obeys.
std::uint64_t largest_answer(const Options& options) { return static_cast<std::uint64_t>(options.receivers) * 16 + (std::uint64_t{1} << 20); }

// The entity tag of a mask, made beside what else is to be done: SHA-256 takes a millisecond or more for the two megabytes of a pair of
// maps. Waits for its end when it goes.
class Tag {
public:
    // `make` gives the tag; what it refers to outlives this. Few bytes are done sooner than a thread has started (some 50 us).
    template <class Make> Tag(std::size_t bytes, Make make)
        : tag_(std::async(bytes < 65536 ? std::launch::deferred : std::launch::async | std::launch::deferred, std::move(make)))
    {
    }

    // Whether the client has that mask already; then the answer is 304.
    bool is_known(const httplib::Request& request, httplib::Response& response) const
    {
        if (!request.has_header("If-None-Match") || !names_tag(request.get_header_value("If-None-Match"), tag_.get())) return false;
        set_on(response);
        response.status = 304;
        return true;
    }
    void set_on(httplib::Response& response) const
    {
        response.set_header("ETag", tag_.get());
        response.set_header("Cache-Control", "private, no-cache");
    }

private:
    std::shared_future<std::string> tag_;
};

} // namespace

// Room for a body. Kept scenes give way, the longest unused first.
Room::Hold Service::room_for(std::size_t bytes)
{
    if (bytes > uploads_.size())
        throw Problem(413, "memory",
                      "the body has " + std::to_string(bytes) + " bytes; all bodies and kept scenes together may take " +
                          std::to_string(uploads_.size()) + " of memory");
    for (;;) {
        if (std::optional<Room::Hold> hold = uploads_.take(bytes)) return std::move(*hold);
        if (!scenes_.forget_one())
            throw Problem(503, "memory",
                          "bodies in flight take " + std::to_string(uploads_.taken()) + " of " + std::to_string(uploads_.size()) +
                              " bytes of memory, and this one needs " + std::to_string(bytes) + "; try again",
                          1);
    }
}

// The body, whole, as long as announced. It goes past the HTTP library's reader, which copies it twice.
SharedBytes Service::read_body(const Request& request)
{
    Connection& connection = Connection::current();
    const auto uploading = Deadline::Clock::now();
    const std::size_t length = static_cast<std::size_t>(length_from(request.get_header_value("Content-Length")).value_or(0));
    SharedBytes body(length, room_for(length));
    const std::size_t came = connection.read_body(body.data(), length);
    if (connection.too_slow())
        throw Problem(408, "slow_body",
                      "the body came at less than " + std::to_string(options_.transfer_bytes_s) + " bytes a second, " +
                          std::to_string(transfer_grace.count()) + " s after its begin");
    if (connection.timed_out() && stopped_) throw service_ends();
    if (connection.timed_out())
        throw Problem(408, "slow_body", "the body did not come within " + std::to_string(options_.deadline_s) + " s of the connection");
    if (came != length)
        throw Problem(400, "short_body", "the body ended after " + std::to_string(came) + " of " + std::to_string(length) + " bytes");
    const double upload_s = seconds_since(uploading);
    connection.cost.bytes_in = length;
    connection.cost.upload_ms = upload_s * 1000;
    metrics_.observe("penumbra_upload_seconds", "", upload_s);
    return body;
}

Gate::Slot Service::enter_slot()
{
    const auto waiting = Deadline::Clock::now();
    Gate::Slot slot = gate_.enter(Connection::current().request());
    const double wait_s = seconds_since(waiting);
    Connection::current().cost.queue_ms = wait_s * 1000;
    metrics_.observe("penumbra_queue_wait_seconds", "", wait_s);
    return slot;
}

template <class Digest>
CallReply Service::computed(Gate::Slot& slot, const Call& call, std::span<const int> files, const Digest& digest)
{
    const Deadline& deadline = Connection::current().request();
    if (crashes_.any()) crashes_.check(digest());
    const auto calling = Deadline::Clock::now();
    auto worker = pool_.lease(call.id, deadline);
    Call timed = call;
    Message message;
    timed.seconds = std::max(std::chrono::duration<double>(deadline.end() - Deadline::Clock::now()).count(), 0.0);
    try {
        message = worker.call(text_of(timed), files, deadline, [&] { return slot.step_aside(); });
    } catch (const Problem& problem) {
        if (problem.reason == "crashed") {
            const std::string name = digest();
            crashes_.note(name);
            Connection::current().inside = "the worker ended; the request's digest: " + name;
        }
        throw;
    }
    if (!call.id.empty()) worker.keeps(call.id);
    if (crashes_.any()) crashes_.absolve(digest());
    CallReply answer = reply_from(message.text);
    // Before the worker is given back, which then uses the file again.
    if (answer.bytes > largest_answer(options_)) throw Error(ErrorCode::internal, "a worker's answer of " + std::to_string(answer.bytes) + " bytes");
    if (!message.files.empty()) answer.reply.bytes = copy_of(message.files.front(), answer.bytes);
    if (answer.spent) worker.retire();
    Connection::current().cost.worker_ms = seconds_since(calling) * 1000;
    if (!answer.problem) return answer;
    Connection::current().inside = answer.inside;
    throw *answer.problem;
}

void Service::post_mask(const Request& request, Response& response)
{
    Connection& connection = Connection::current();
    const auto admitted = gate_.admit();
    const MaskChoice choice = choice_of(request);
    const MaskFormat& format = negotiate(request.get_header_value("Accept"), choice.image);
    const SharedBytes body = read_body(request);
    const std::string form = boundary_of(connection.content_type);
    const auto parts = parse_multipart(body, form, static_cast<std::size_t>(options_.parts));
    const auto content = [&] { return id_of(parts); };
    const Tag tag(body.size(), [&] { return etag_of(device_, content(), choice, format); });
    if (tag.is_known(request, response)) return;

    auto slot = enter_slot();
    const std::array files{body.descriptor()};
    const Call call{.kind = Call::Kind::mask, .form = form, .choice = choice, .format = std::string(format.format)};
    send_mask(response, computed(slot, call, files, content), format);
    tag.set_on(response);
}

void Service::post_scene(const Request& request, Response& response)
{
    if (options_.scenes == 0) throw Problem(403, "no_scenes", "this service keeps no scenes (--scenes 0)");
    Connection& connection = Connection::current();
    const auto admitted = gate_.admit();
    SharedBytes body = read_body(request);
    const std::string form = boundary_of(connection.content_type);
    std::string id = id_of(parse_multipart(body, form, static_cast<std::size_t>(options_.parts)));
    auto scene = scenes_.find(id, true);
    response.status = scene ? 200 : 201;
    if (!scene) {
        auto slot = enter_slot();
        const std::array files{body.descriptor()};
        const CallReply answer = computed(slot, {.kind = Call::Kind::keep, .form = form, .id = id}, files, [&] { return id; });
        connection.cost.decode_ms = answer.decode_ms;
        scene = std::make_shared<KeptUpload>(id, std::move(body), form, answer.scene.value(), [this, id] { pool_.forget(id); });
        scenes_.keep(scene);
    }
    response.set_header("Location", "/v1/scenes/" + id);
    response.set_content(describe(*scene), "application/json");
}

void Service::post_depth(const Request& request, Response& response)
{
    Connection& connection = Connection::current();
    const auto admitted = gate_.admit();
    const int side = depth_side_from({request.params.begin(), request.params.end()});
    const SharedBytes body = read_body(request);
    const std::string form = boundary_of(connection.content_type);
    const auto parts = parse_multipart(body, form, static_cast<std::size_t>(options_.parts));

    auto slot = enter_slot();
    const std::array files{body.descriptor()};
    CallReply answer = computed(slot, {.kind = Call::Kind::depth, .form = form, .side = side}, files, [&] { return id_of(parts); });
    if (answer.reply.bytes.empty()) throw Error(ErrorCode::internal, "a worker's answer without its depth");
    response.status = 200;
    response.set_header("Penumbra-Size", std::to_string(answer.width) + "x" + std::to_string(answer.height));
    if (!answer.reply.warnings.empty()) response.set_header("Penumbra-Warnings", warnings_header(answer.reply.warnings));
    response.body = std::move(answer.reply.bytes);
    response.set_header("Content-Type", "image/x-portable-floatmap");
}

void Service::post_kept_mask(const Request& request, Response& response)
{
    Connection& connection = Connection::current();
    const auto admitted = gate_.admit();
    const auto scene = scenes_.find(id_in(request), true);
    if (!scene) throw no_scene();
    const MaskChoice choice = choice_of(request);
    const MaskFormat& format = negotiate(request.get_header_value("Accept"), choice.image);
    const SharedBytes body = read_body(request);
    std::string form;
    std::vector<Part> parts;
    std::string_view patch = body;
    if (body.size() > 0 && !is_json(connection.content_type)) {
        form = boundary_of(connection.content_type);
        parts = parse_multipart(body, form, static_cast<std::size_t>(options_.parts));
        const Part* const part = find_scene(parts, options_);
        patch = part ? part->bytes : std::string_view();
    }
    const auto content = [&] { return KeptScene::content_of(scene->id(), patch, parts); };
    const Tag tag(body.size(), [&] { return etag_of(device_, content(), choice, format); });
    if (tag.is_known(request, response)) return;

    auto slot = enter_slot();
    const std::array files{scene->body().descriptor(), body.descriptor()};
    const Call call{.kind = Call::Kind::kept,
                    .form = scene->form(),
                    .id = scene->id(),
                    .patch_form = form,
                    .choice = choice,
                    .format = std::string(format.format)};
    CallReply answer = computed(slot, call, files, content);
    if (answer.scene) scene->set_size(*answer.scene);
    send_mask(response, std::move(answer), format);
    tag.set_on(response);
    scenes_.tidy();
}

void Service::send_mask(Response& response, CallReply answer, const MaskFormat& format)
{
    RequestCost& cost = Connection::current().cost;
    MaskReply& reply = answer.reply;
    if (reply.bytes.empty()) throw Error(ErrorCode::internal, "a worker's answer without its mask");
    cost.decode_ms = answer.decode_ms;
    cost.technique = reply.technique;
    cost.compute_ms = reply.compute_ms;
    cost.encode_ms = reply.encode_ms;
    metrics_.observe("penumbra_decode_seconds", "", cost.decode_ms / 1000);
    metrics_.observe("penumbra_compute_seconds", "technique=\"" + reply.technique + "\"", cost.compute_ms / 1000);
    metrics_.observe("penumbra_encode_seconds", "format=\"" + std::string(format.format) + "\"", cost.encode_ms / 1000);
    metrics_.count("penumbra_pixels_total", "", static_cast<double>(reply.pixels));
    std::uint64_t peak = peak_device_bytes_;
    while (reply.device_bytes > peak && !peak_device_bytes_.compare_exchange_weak(peak, reply.device_bytes)) {
    }

    reply.stages.insert(reply.stages.begin(), {{"upload", cost.upload_ms}, {"queue", cost.queue_ms}, {"decode", cost.decode_ms}});
    response.status = 200;
    response.set_header("Server-Timing", server_timing(reply.stages));
    if (!reply.warnings.empty()) response.set_header("Penumbra-Warnings", warnings_header(reply.warnings));
    if (!reply.error_estimate.empty()) response.set_header("Penumbra-Error-Estimate", reply.error_estimate);
    response.body = std::move(reply.bytes);
    response.set_header("Content-Type", std::string(format.media_type));
}

std::string Service::describe(const KeptUpload& scene)
{
    const nlohmann::ordered_json json = {
        {"id", scene.id()}, {"expires_s", scenes_.seconds_left(scene.id())}, {"bytes", scene.bytes()}, {"warnings", scene.facts().warnings}};
    return json.dump(2, ' ', true, nlohmann::json::error_handler_t::replace) + "\n";
}

void Service::get_scene(const Request& request, Response& response)
{
    const auto scene = scenes_.find(id_in(request), false);
    if (!scene) throw no_scene();
    response.set_content(describe(*scene), "application/json");
}

void Service::delete_scene(const Request& request, Response& response)
{
    if (!scenes_.forget(id_in(request))) throw no_scene();
    response.status = 204;
}

} // namespace penumbra::server
