#include "masks/worker.hpp"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <optional>
#include <system_error>
#include <thread>

#include <sys/prctl.h>
#include <unistd.h>

#include <penumbra/describe.hpp>
#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>
#include <penumbra/image.hpp>
#include <penumbra/stop.hpp>

#include "masks/call.hpp"
#include "masks/depth_view.hpp"
#include "masks/kept_scene.hpp"
#include "masks/multipart.hpp"
#include "masks/scene_store.hpp"
#include "masks/work_limits.hpp"
#include "process/confinement.hpp"
#include "process/memory.hpp"
#include "process/own_memory.hpp"
#include "process/ready.hpp"
#include "process/shared_bytes.hpp"
#include "process/watch.hpp"

namespace penumbra::server {
namespace {

const MaskFormat& format_named(std::string_view format)
{
    for (const MaskFormat& known : mask_formats())
        if (known.format == format) return known;
    return mask_formats().front();
}

// Libraries load what they need when the first image of a format comes: some 100 MiB, of a request's share. Rather now.
void warm_formats(const std::string& temporary)
{
    if (temporary.empty()) return;
    const Image image{.width = 16, .height = 16, .channels = 1, .pixels = std::vector<float>(256, 0.5F)};
    for (const MaskFormat& format : mask_formats()) {
        const std::string path = temporary + "/warm." + std::string(format.format);
        write_image(path, image, {.format = std::string(format.format)});
        if (read_image(path).pixels.size() != image.pixels.size()) throw Error(ErrorCode::internal, std::string(format.format) + ": an image came back otherwise");
        std::filesystem::remove(path);
    }
}

double milliseconds_since(Deadline::Clock::time_point begin) { return seconds_since(begin) * 1000; }

class Worker {
public:
    Worker(const Options& options, const Engine& engine, std::string temporary)
        : options_(options), engine_(engine), temporary_(std::move(temporary)),
          scenes_(std::min(static_cast<std::uint64_t>(options.scenes_bytes) / (static_cast<std::uint64_t>(options.slots) + spare_workers(options)),
                           worker_memory(options) / 4),
                  static_cast<std::size_t>(options.scenes), std::chrono::seconds(options.scenes_s))
    {
    }

    void forget(std::string_view id) { scenes_.forget(id); }
    std::uint64_t kept_bytes() { return scenes_.counts().bytes; }

    // `bytes`: what goes beside the answer.
    CallReply answer(const Call& call, std::vector<Descriptor> files, std::string& bytes)
    {
        const auto left = std::chrono::duration_cast<Deadline::Clock::duration>(std::chrono::duration<double>(call.seconds));
        const std::chrono::seconds limit(options_.deadline_s);
        const Deadline deadline(limit, Deadline::Clock::now() + left - limit);
        const auto watched = watch_.until(deadline);
        limit_processor(static_cast<std::uint64_t>(call.seconds + 2) * std::max(std::thread::hardware_concurrency(), 1U));
        std::vector<SharedBytes> shared;
        shared.reserve(std::max(files.size(), std::size_t{2}));
        for (Descriptor& file : files) shared.emplace_back(std::move(file));
        shared.resize(2);
        try {
            return with_room(call, shared, deadline, bytes);
        } catch (const Stopped&) {
            throw deadline.over();
        }
    }

private:
    // Once more without the scenes that are kept decoded, if memory was short: the service has what they are made from.
    CallReply with_room(const Call& call, const std::vector<SharedBytes>& shared, const Deadline& deadline, std::string& bytes)
    {
        try {
            return done(call, shared, deadline, bytes);
        } catch (const std::bad_alloc&) {
            if (scenes_.counts().scenes == 0) throw;
        }
        scenes_.clear();
        return done(call, shared, deadline, bytes);
    }

    CallReply done(const Call& call, const std::vector<SharedBytes>& shared, const Deadline& deadline, std::string& bytes)
    {
        switch (call.kind) {
        case Call::Kind::warm:
            check_known_mask(engine_);
            warm(engine_);
            warm_formats(temporary_);
            return {};
        case Call::Kind::mask:
            return mask(call, shared[0], deadline, bytes);
        case Call::Kind::depth:
            return depth(call, shared[0], deadline, bytes);
        case Call::Kind::keep:
            return keep(call, shared[0], deadline);
        case Call::Kind::kept:
            return kept(call, shared[0], shared[1], deadline, bytes);
        }
        throw Error(ErrorCode::internal, "a call of no kind");
    }

    std::vector<Part> parts_of(std::string_view body, const std::string& form) const
    {
        return parse_multipart(body, form, static_cast<std::size_t>(options_.parts));
    }

    CallReply computed(const Call& call, const MaskTask& task, const Deadline& deadline, Deadline::Clock::time_point decoding, std::string& bytes)
    {
        CallReply answer;
        answer.decode_ms = milliseconds_since(decoding);
        answer.reply = compute_mask(engine_, task, format_named(call.format), options_, deadline);
        bytes = std::move(answer.reply.bytes);
        return answer;
    }

    CallReply mask(const Call& call, std::string_view body, const Deadline& deadline, std::string& bytes)
    {
        const auto decoding = Deadline::Clock::now();
        const auto parts = parts_of(body, call.form);
        const MaskTask task = task_of(parts, call.choice, options_, deadline);
        return computed(call, task, deadline, decoding, bytes);
    }

    CallReply depth(const Call& call, std::string_view body, const Deadline& deadline, std::string& bytes)
    {
        const Scene scene = decode_scene(parts_of(body, call.form), options_, deadline);
        const std::vector<std::byte> image = encode_image(depth_view(scene.receivers, call.side), {.format = "pfm", .bits = 32});
        bytes.assign(reinterpret_cast<const char*>(image.data()), image.size());
        CallReply answer;
        answer.reply.warnings = scene.warnings;
        answer.width = scene.receivers.width;
        answer.height = scene.receivers.height;
        return answer;
    }

    std::shared_ptr<KeptScene> scene_of(const Call& call, std::string_view body, const Deadline& deadline)
    {
        return std::make_shared<KeptScene>(call.id, parts_of(body, call.form), options_, deadline);
    }

    static SceneFacts facts_of(const KeptScene& scene)
    {
        return {.bytes = scene.bytes(), .device_bytes = scene.device_bytes(), .warnings = scene.warnings()};
    }

    CallReply keep(const Call& call, std::string_view body, const Deadline& deadline)
    {
        const auto decoding = Deadline::Clock::now();
        const auto scene = scene_of(call, body, deadline);
        const MaskTask task = scene->task({}, {}, scene->first_choice(), options_, deadline);
        CallReply answer;
        answer.decode_ms = milliseconds_since(decoding);
        check_work(task, options_);
        prepare_all(engine_, task, deadline);
        scenes_.keep(scene);
        answer.scene = facts_of(*scene);
        return answer;
    }

    CallReply kept(const Call& call, std::string_view body, std::string_view change, const Deadline& deadline, std::string& bytes)
    {
        const auto decoding = Deadline::Clock::now();
        auto scene = scenes_.find(call.id, true);
        if (!scene) {
            scene = scene_of(call, body, deadline);
            scenes_.keep(scene);
        }
        std::vector<Part> parts;
        std::string_view patch = change;
        if (!call.patch_form.empty()) {
            parts = parts_of(change, call.patch_form);
            const Part* const part = find_scene(parts, options_);
            patch = part ? part->bytes : std::string_view();
        }
        const MaskTask task = scene->task(patch, parts, call.choice, options_, deadline);
        CallReply answer = computed(call, task, deadline, decoding, bytes);
        scenes_.tidy();
        answer.scene = facts_of(*scene);
        return answer;
    }

    const Options& options_;
    const Engine& engine_;
    const std::string temporary_; // folder; empty: none
    // A driver that compiles would go on for seconds. What it makes lies in this worker's own folder, and goes with it.
    Watch watch_{[] { _exit(ended_at_deadline); }};
    SceneStore scenes_;
};

// Runs it; whatever it throws becomes an answer.
template <class Call> CallReply guarded(const Call& call, std::uint64_t memory)
{
    CallReply answer;
    try {
        return call();
    } catch (const Problem& problem) {
        answer.problem = problem;
    } catch (const Error& error) {
        answer.problem = problem_from(error);
        answer.inside = error.what();
    } catch (const std::bad_alloc&) {
        answer.problem = out_of_memory(memory);
    } catch (const std::exception& error) {
        answer.problem = defect();
        answer.inside = error.what();
    }
    return answer;
}

// What strangers' bytes must not reach is closed before any comes.
Greeting greet(const Options& options, bool own_kernels, const std::string& temporary, std::optional<Engine>& engine)
{
    Greeting greeting;
    if (leave_network()) greeting.closed.emplace_back("the network (a namespace)");
    prctl(PR_SET_PDEATHSIG, SIGKILL); // after what changes rights, which takes it back
    greeting.memory = worker_memory(options);
    limit_memory(greeting.memory);
    if (own_kernels) {
        setenv("PENUMBRA_CACHE_DIR", own_cache(temporary).c_str(), 1);
        unsetenv("POCL_CACHE_DIR");
    }
    prepare_environment();
    if (const char* const folder = std::getenv("POCL_CACHE_DIR")) greeting.kernels = folder; // as was just chosen
    // After the folder of kernels was chosen.
    if (!temporary.empty()) setenv("TMPDIR", temporary.c_str(), 1);
    if (close_files(folders_of_a_worker(temporary, !own_kernels))) greeting.closed.emplace_back("files (Landlock)");
    if (close_calls()) greeting.closed.emplace_back("sockets and system calls (seccomp)");
    engine.emplace(options.device.empty() ? Engine() : Engine(options.device));
    const DeviceInfo device = engine->device();
    greeting.device = device.name;
    greeting.driver = device.driver;
    greeting.devices_json = devices_json(list_devices(), device.index);
    greeting.warnings = environment_warnings(device);
    return greeting;
}

} // namespace

std::string own_cache(const std::string& temporary) { return temporary + "/cache"; }

int work(const Options& options, Kernels kernels, const std::string& temporary, Channel channel)
{
    std::error_code unknown;
    const bool own_kernels = kernels == Kernels::own && std::filesystem::is_directory(own_cache(temporary), unknown);
    give_back_large_blocks();
    std::optional<Engine> engine;
    Greeting greeting;
    try {
        greeting = greet(options, own_kernels, temporary, engine);
    } catch (const Error& error) {
        greeting.problem = error.what();
        greeting.code = static_cast<int>(error.code());
    }
    if (!channel.send(text_of(greeting)) || !greeting.problem.empty()) return 1;

    // The builder of kernels takes no requests: it needs no formats.
    Worker worker(options, *engine, kernels == Kernels::own ? temporary : std::string());
    Outbox outbox;
    std::optional<Retention> retention; // from the first call on, which warms it
    for (Message message; channel.receive(message, Channel::Clock::time_point::max()) == Channel::Got::message;) {
        if (message.text.starts_with("forget")) {
            worker.forget(std::string_view(message.text).substr(6));
            continue;
        }
        std::string bytes;
        int file = -1;
        CallReply answer = guarded(
            [&] {
                CallReply done = worker.answer(call_from(message.text), std::move(message.files), bytes);
                done.bytes = bytes.size();
                if (!bytes.empty()) file = outbox.put(bytes);
                return done;
            },
            greeting.memory);
        if (!retention) retention.emplace(greeting.memory);
        answer.spent = retention->too_much(worker.kept_bytes());
        if (!channel.send(text_of(answer), std::span(&file, file >= 0 ? 1 : 0))) break;
    }
    return 0;
}

} // namespace penumbra::server
