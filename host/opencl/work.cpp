#include "opencl/work.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

#include "opencl/driver_cache.hpp"
#include "opencl/errors.hpp"
#include "opencl/ledger.hpp"
#include "opencl/linker.hpp"
#include "scene/memory.hpp"

namespace penumbra::opencl {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) { return std::chrono::duration<double, std::milli>(Clock::now() - start).count(); }

// The event must be complete, its queue a profiling one.
double device_milliseconds(const cl::Event& event)
{
    const cl_ulong start = event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
    const cl_ulong end = event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
    return end > start ? static_cast<double>(end - start) * 1e-6 : 0.0;
}

// From when the device begins with the work there is no compiler in its way.
void end_when_it_runs(cl::Event& event, std::shared_ptr<Deaf> deaf)
{
    auto kept = std::make_unique<std::shared_ptr<Deaf>>(std::move(deaf));
    event.setCallback(
        CL_RUNNING,
        [](cl_event, cl_int, void* data) {
            const std::unique_ptr<std::shared_ptr<Deaf>> its(static_cast<std::shared_ptr<Deaf>*>(data));
            (*its)->end();
        },
        kept.get());
    static_cast<void>(kept.release()); // the callback's
}

// "64 x 32"
std::string shape_text(const std::array<std::size_t, 2>& shape) { return std::to_string(shape[0]) + " x " + std::to_string(shape[1]); }

// What a buffer's last owner leaves behind: bytes given back, the guard tail checked.
struct Guard {
    std::shared_ptr<Ledger> ledger;
    std::shared_ptr<MemoryMeter> meter;
    std::uint64_t bytes = 0;
    std::optional<GuardedBuffer> guarded = std::nullopt;
    cl::CommandQueue queue = {};

    Guard(std::shared_ptr<Ledger> the_ledger, std::shared_ptr<MemoryMeter> the_meter)
        : ledger(std::move(the_ledger)), meter(std::move(the_meter))
    {
    }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;

    ~Guard()
    {
        if (guarded) {
            try {
                if (auto violation = canary_violation(queue, *guarded)) ledger->record_violation(std::move(*violation));
                ledger->unwatch(guarded->memory);
            } catch (...) {
                // Nothing can be thrown here, and a device that fails now fails the next call too.
            }
        }
        meter->live -= bytes;
        ledger->give_back(bytes);
    }

    void take(std::uint64_t taken)
    {
        bytes = taken;
        const std::uint64_t live = meter->live += taken;
        std::uint64_t peak = meter->peak;
        while (peak < live && !meter->peak.compare_exchange_weak(peak, live)) {
        }
    }
};

// The number of items rounded up to whole work-groups.
std::array<std::size_t, 2> whole_groups(const char* kernel, const std::array<std::size_t, 2>& global,
                                        const std::array<std::size_t, 2>& local)
{
    std::array<std::size_t, 2> whole = {};
    for (std::size_t i = 0; i < whole.size(); ++i) {
        if (local[i] == 0 || global[i] > std::numeric_limits<std::size_t>::max() - local[i]) {
            throw Error(ErrorCode::internal, std::string("kernel ") + kernel + ": a launch over " + shape_text(global) +
                                                 " items in work-groups of " + shape_text(local) + " is not possible");
        }
        whole[i] = (global[i] + local[i] - 1) / local[i] * local[i];
    }
    return whole;
}

// Work-group shape and local memory against the limits of kernel and device, so that the message has the numbers.
void check_limits(const Context& context, const cl::Kernel& kernel, const char* name, const std::array<std::size_t, 2>& local)
{
    const DeviceInfo& device = context.info();
    const auto refuse = [&](const std::string& problem) {
        throw Error(ErrorCode::too_large, std::string("kernel ") + name + ": " + problem + " of " + device.name);
    };

    const auto sides = context.device().getInfo<CL_DEVICE_MAX_WORK_ITEM_SIZES>();
    for (std::size_t i = 0; i < local.size() && i < sides.size(); ++i) {
        if (local[i] > sides[i]) {
            refuse("a work-group of " + shape_text(local) + " is over the limit of " + std::to_string(sides[i]) + " in dimension " +
                   std::to_string(i));
        }
    }

    // By division: the product may not fit.
    const std::size_t items =
        std::min<std::size_t>(kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(context.device()), device.max_work_group);
    if (local[0] > items / local[1]) {
        refuse("a work-group of " + shape_text(local) + " is over the limit of " + std::to_string(items) + " work-items");
    }
    const cl_ulong local_bytes = kernel.getWorkGroupInfo<CL_KERNEL_LOCAL_MEM_SIZE>(context.device());
    if (local_bytes > device.local_bytes) {
        refuse(bytes_text(local_bytes) + " of local memory are over the " + bytes_text(device.local_bytes));
    }
}

} // namespace

Work::Work(std::shared_ptr<const Context> context) : context_(std::move(context)), queue_(context_->queue()) {}

Work::Work(std::shared_ptr<const LateContext> late) : late_(std::move(late)) {}

void Work::open()
{
    if (context_) return;
    context_ = late_->get();
    queue_ = context_->queue();
}

Work::Work(std::shared_ptr<const Context> context, cl_command_queue queue) : context_(std::move(context)), own_queue_(false)
{
    if (!queue) throw Error(ErrorCode::usage, "the command queue is null");
    translated("the caller's command queue", [&] {
        queue_ = cl::CommandQueue(queue, true);
        if (queue_.getInfo<CL_QUEUE_CONTEXT>()() != context_->context()() || queue_.getInfo<CL_QUEUE_DEVICE>()() != context_->device()()) {
            throw Error(ErrorCode::usage, "the command queue belongs to another OpenCL context or device than the engine");
        }
        const cl_command_queue_properties properties = queue_.getInfo<CL_QUEUE_PROPERTIES>();
        if (properties & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE)
            throw Error(ErrorCode::usage, "the command queue is out of order; an in-order queue is needed");
        profiled_ = (properties & CL_QUEUE_PROFILING_ENABLE) != 0;
    });
}

Work::~Work()
{
    if (later_.empty()) return;
    try {
        queue_.finish(); // it writes to what they keep
    } catch (...) {
        // A queue that cannot be waited for runs nothing more.
    }
}

cl::Kernel Work::kernel(const Specialisation& specialisation, const char* name)
{
    const auto same = [&](const OwnKernel& one) { return one.name == name && one.file == specialisation.file && one.constants == specialisation.constants; };
    const auto at = std::find_if(kernels_.begin(), kernels_.end(), same);
    if (at != kernels_.end()) return at->kernel;
    return kernels_.emplace_back(OwnKernel{specialisation.file, name, specialisation.constants, context().kernel(specialisation, name, compile_ms_)}).kernel;
}

Work::StopBuffer::~StopBuffer()
{
    try {
        queue.finish();
    } catch (...) {
        // A queue that cannot be waited for runs nothing more.
    }
}

cl::Buffer Work::stop()
{
    if (!stop_ || !own_queue_ || !context().quirks().host_memory) return {};
    if (!stop_buffer_) {
        static_assert(sizeof(stop_->asked) == sizeof(cl_int));
        translated("the word that stops kernels", [&] {
            cl::Buffer memory(context_->context(), CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, sizeof(StopWord), stop_.get());
            stop_buffer_ = std::make_unique<StopBuffer>(stop_, std::move(memory), queue_);
        });
    }
    return stop_buffer_->memory;
}

void Work::check_stop() const { penumbra::check_stop(stop_.get()); }

std::pair<cl::Buffer, std::shared_ptr<void>> Work::allocate(std::uint64_t bytes, const char* what)
{
    // The room that an empty buffer gets: one element of the largest type, a double16.
    constexpr std::uint64_t least = 128;
    open();
    const DeviceInfo& device = context_->info();
    const std::uint64_t tail = context_->canaries ? canary_bytes : 0;
    const auto refuse = [&](const std::string& limit) -> Error {
        return Error(ErrorCode::too_large, std::string(what) + " needs " + bytes_text(bytes) + " on the device; " + limit,
                     "use smaller maps, or a device with more memory");
    };

    if (bytes > device.max_allocation_bytes || bytes + tail > device.max_allocation_bytes) {
        throw refuse("the largest allocation of " + device.name + " is " + bytes_text(device.max_allocation_bytes));
    }
    const std::uint64_t whole = std::max(bytes + tail, least);

    // Some drivers (PoCL) hand out more than there is, and the process dies when it is touched.
    auto guard = std::make_shared<Guard>(context_->ledger(), memory_);
    if (!context_->ledger()->take(whole, device.global_bytes)) {
        throw refuse(device.name + " has " + bytes_text(device.global_bytes) + ", of which " + bytes_text(context_->ledger()->live()) +
                     " are in use");
    }
    if (context_->quirks().host_memory) require_memory(static_cast<double>(whole), what);
    guard->take(whole);

    try {
        cl::Buffer memory(context_->context(), CL_MEM_READ_WRITE, whole);
        if (tail > 0) {
            const GuardedBuffer guarded{memory, bytes, what};
            plant_canary(queue_, guarded);
            context_->ledger()->watch(memory_.get(), guarded);
            guard->queue = queue_;
            guard->guarded = guarded;
        }
        return {std::move(memory), std::move(guard)};
    } catch (const cl::Error& error) {
        const bool full = error.err() == CL_MEM_OBJECT_ALLOCATION_FAILURE || error.err() == CL_INVALID_BUFFER_SIZE;
        throw full ? refuse(device.name + " refused: " + error.what() + " failed with " + error_name(error.err()))
                   : device_error(error, what);
    }
}

bool Work::lends(std::size_t bytes) { return bytes > 0 && own_queue_ && context().quirks().host_memory && !context().canaries; }

std::pair<cl::Buffer, std::shared_ptr<void>> Work::lent(const void* data, std::size_t bytes)
{
    ensure_stage();
    stages_[current_].bytes += bytes;
    // Nobody writes there: OpenCL has no pointer to const.
    return translated("memory lent to kernels", [&] {
        cl::Buffer memory(context_->context(), CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, bytes, const_cast<void*>(data));
        std::shared_ptr<void> guard(nullptr, [queue = queue_](void*) {
            try {
                queue.finish();
            } catch (...) {
                // A device that fails now fails the next call too.
            }
        });
        return std::pair{std::move(memory), std::move(guard)};
    });
}

void Work::write(const cl::Buffer& memory, const void* data, std::size_t bytes)
{
    if (bytes == 0) return;
    ensure_stage();
    // Blocking: the host's memory may be gone when the caller's queue gets here.
    translated("upload of " + bytes_text(bytes), [&] { queue_.enqueueWriteBuffer(memory, CL_TRUE, 0, bytes, data, nullptr, new_event()); });
    stages_[current_].bytes += bytes;
}

void Work::copy(const cl::Buffer& from, const cl::Buffer& to, std::size_t bytes, std::size_t offset)
{
    if (bytes == 0) return;
    ensure_stage();
    translated("copy of " + bytes_text(bytes), [&] { queue_.enqueueCopyBuffer(from, to, 0, offset, bytes, nullptr, new_event()); });
    stages_[current_].bytes += 2 * bytes;
}

void Work::read(const cl::Buffer& memory, void* data, std::size_t bytes, std::size_t offset)
{
    ensure_stage();
    translated("reading back " + bytes_text(bytes), [&] {
        if (bytes > 0) queue_.enqueueReadBuffer(memory, CL_TRUE, offset, bytes, data, nullptr, new_event());
        stages_[current_].bytes += bytes;
        check_stop();
        use_read();
        if (!context_->canaries) return;
        if (const auto guarded = context_->ledger()->watched(memory)) {
            if (const auto violation = canary_violation(queue_, *guarded)) throw Error(ErrorCode::internal, *violation);
        }
    });
}

void Work::read_later(const cl::Buffer& memory, void* data, std::size_t bytes, std::function<void()> use)
{
    ensure_stage();
    if (bytes > 0)
        translated("reading back " + bytes_text(bytes), [&] {
            later_.push_back(std::move(use));
            queue_.enqueueReadBuffer(memory, CL_FALSE, 0, bytes, data, nullptr, new_event());
        });
    stages_[current_].bytes += bytes;
    if (!own_queue_) {
        queue_.finish();
        use_read();
    }
}

// The queue is in order: what was asked for before the last wait is there.
void Work::use_read()
{
    for (const auto& use : std::exchange(later_, {})) use();
}

void Work::enqueue(cl::Kernel& kernel, const char* name, std::array<std::size_t, 2> global, std::array<std::size_t, 2> local,
                   std::uint64_t bytes)
{
    open();
    check_stop();
    const std::array<std::size_t, 2> whole = whole_groups(name, global, local);
    if (global[0] == 0 || global[1] == 0) return;
    ensure_stage();
    try {
        const bool known = std::any_of(launched_.begin(), launched_.end(), [&](const Launched& one) { return one.kernel == kernel() && one.local == local; });
        if (!known) check_limits(*context_, kernel, name, local);

        // Drivers compile for the work-group's shape at the first launch. On a queue of our own that is told from the work by waiting for
        // it.
        const bool first = !known && own_queue_ && context_->first_launch(kernel, name, local);
        if (first) queue_.finish();
        const Quirks& quirks = context_->quirks();
        std::optional<RecordingIfSlow> recording;
        if (quirks.driver_cache && (first || !own_queue_)) {
            driver_cache().require_room();
            if (quirks.system_linker && linker().empty()) driver_cache().require_library(name, whole, local);
            if (first)
                recording.emplace();
            else
                context_->unrecorded = true;
        }
        const bool own = std::any_of(kernels_.begin(), kernels_.end(), [&](const OwnKernel& one) { return one.kernel() == kernel(); });
        if (!known && own) launched_.push_back({kernel(), local});
        const Clock::time_point start = Clock::now();
        const auto compiling = first ? std::make_shared<Deaf>(stop_) : nullptr;
        queue_.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(whole[0], whole[1]), cl::NDRange(local[0], local[1]), nullptr,
                                    new_event());
        if (first) {
            end_when_it_runs(events_.back().second, compiling);
            queue_.finish();
            compiling->end();
            compile_ms_ += std::max(0.0, milliseconds_since(start) - device_milliseconds(events_.back().second));
        }
    } catch (const cl::Error& error) {
        const Error told =
            device_error(error, std::string("kernel ") + name + ", global " + shape_text(whole) + ", local " + shape_text(local));
        // Arguments that were never set are our mistake.
        throw error.err() == CL_INVALID_KERNEL_ARGS ? Error(ErrorCode::internal, told.message()) : told;
    }
    stages_[current_].bytes += bytes;
}

void Work::set_argument_bytes(cl::Kernel& kernel, const char* name, cl_uint index, std::size_t bytes, const void* value)
{
    const cl_int code = clSetKernelArg(kernel(), index, bytes, value);
    if (code == CL_SUCCESS) return;

    // Arguments are ours to get right, whatever the driver calls the mistake.
    const bool ours =
        code == CL_INVALID_ARG_SIZE || code == CL_INVALID_ARG_INDEX || code == CL_INVALID_ARG_VALUE || code == CL_INVALID_MEM_OBJECT;
    throw Error(ours ? ErrorCode::internal : ErrorCode::device,
                std::string("kernel ") + name + ", argument " + std::to_string(index) + " of " +
                    std::to_string(translated(name, [&] { return kernel.getInfo<CL_KERNEL_NUM_ARGS>(); })) + ", " + bytes_text(bytes) +
                    ": clSetKernelArg failed with " + error_name(code));
}

cl::Event* Work::new_event()
{
    if (!profiled_) return nullptr;
    return &events_.emplace_back(current_, cl::Event()).second;
}

void Work::stage(const char* name)
{
    if (held_ > 0) return;
    end_stage();
    const auto at = std::find_if(stages_.begin(), stages_.end(), [name](const Stage& stage) { return stage.name == name; });
    current_ = static_cast<std::size_t>(at - stages_.begin());
    if (at == stages_.end()) stages_.push_back({name});
    running_ = true;
    started_ = Clock::now();
}

void Work::moved(std::uint64_t bytes)
{
    ensure_stage();
    stages_[current_].bytes += bytes;
}

void Work::ensure_stage()
{
    if (!running_) stage("work");
}

void Work::end_stage()
{
    if (!running_) return;
    running_ = false;
    if (own_queue_ && context_) translated("stage " + stages_[current_].name, [&] {
            queue_.finish();
            use_read();
        });
    stages_[current_].ms += std::max(0.0, milliseconds_since(started_) - compile_ms_);
    total_compile_ms_ += std::exchange(compile_ms_, 0.0);
}

std::vector<Stage> Work::finish()
{
    end_stage();
    check_stop();
    add_device_times();
    check_canaries();

    if (const double compile_ms = std::exchange(total_compile_ms_, 0.0) + std::exchange(compile_ms_, 0.0); compile_ms > 0) {
        const auto at = std::find_if(stages_.begin(), stages_.end(), [](const Stage& stage) { return stage.name == "compile"; });
        (at == stages_.end() ? stages_.emplace_back(Stage{"compile"}) : *at).ms += compile_ms;
    }
    events_.clear();
    current_ = 0;
    return std::exchange(stages_, {});
}

void Work::add_device_times()
{
    translated("profiling", [&] {
        std::vector<bool> unknown(stages_.size(), false);
        for (const auto& [stage, event] : events_) {
            // On the caller's queue work may still be under way; a part of a stage's time would mislead.
            if (!event() || event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() != CL_COMPLETE) {
                unknown[stage] = true;
            } else {
                stages_[stage].device_ms += device_milliseconds(event);
            }
        }
        for (std::size_t i = 0; i < unknown.size(); ++i) {
            if (unknown[i]) stages_[i].device_ms = 0;
        }
    });
}

void Work::check_canaries()
{
    if (!context_ || !context_->canaries) return;
    if (const auto violation = context_->ledger()->take_violation()) throw Error(ErrorCode::internal, *violation);
    if (!own_queue_) return; // nothing waits here; reading and dropping check
    translated("checking guard tails", [&] {
        for (const GuardedBuffer& buffer : context_->ledger()->watched_by(memory_.get())) {
            if (const auto violation = canary_violation(queue_, buffer)) throw Error(ErrorCode::internal, *violation);
        }
    });
}

} // namespace penumbra::opencl
