// One piece of work on one queue: buffers, launches and copies, timed in named stages.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "opencl/context.hpp"
#include "scene/stop.hpp"

namespace penumbra::opencl {

// Bytes on the device now and at most, of one piece of work and what it keeps. Atomic, because what it keeps may be dropped by another
// thread.
struct MemoryMeter {
    std::atomic<std::uint64_t> live = 0, peak = 0;
};

// `count` elements of T on the device; owns them, moves, does not copy.
template <class T> class Buffer {
public:
    Buffer() = default;
    Buffer(cl::Buffer memory, std::size_t count, std::shared_ptr<void> guard)
        : memory_(std::move(memory)), count_(count), guard_(std::move(guard))
    {
    }
    const cl::Buffer& memory() const { return memory_; }
    std::size_t count() const { return count_; }
    std::uint64_t bytes() const { return static_cast<std::uint64_t>(count_) * sizeof(T); }
    explicit operator bool() const { return memory_() != nullptr; }

private:
    cl::Buffer memory_;
    std::size_t count_ = 0;
    std::shared_ptr<void> guard_; // gives the bytes back to the meter, checks the canary
};

class Work {
public:
    explicit Work(std::shared_ptr<const Context> context);                // on a queue of its own
    explicit Work(std::shared_ptr<const LateContext> late);               // the same, once something needs the device
    Work(std::shared_ptr<const Context> context, cl_command_queue queue); // on the caller's; nothing here then waits for the device
    ~Work();
    Work(const Work&) = delete;
    Work& operator=(const Work&) = delete;

    const Context& context()
    {
        open();
        return *context_;
    }
    const cl::CommandQueue& queue()
    {
        open();
        return queue_;
    }

    // Room for `count` elements, not initialised. At least one element is allocated. Throws too_large with the numbers when over the
    // device's largest allocation or its memory.
    template <class T> Buffer<T> buffer(std::size_t count, const char* what)
    {
        // A count whose bytes do not fit 64 bits is over every limit.
        constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
        auto [memory, guard] = allocate(count > most / sizeof(T) ? most : static_cast<std::uint64_t>(count) * sizeof(T), what);
        return Buffer<T>(std::move(memory), count, std::move(guard));
    }
    template <class T> Buffer<T> upload(std::span<const T> data, const char* what)
    {
        Buffer<T> buffer = this->buffer<T>(data.size(), what);
        write(buffer.memory(), data.data(), data.size_bytes());
        return buffer;
    }
    // The caller's own memory, for kernels to read. It has to outlive the buffer, which waits for them. Where the device has memory of its own: uploaded.
    template <class T> Buffer<T> lend(std::span<const T> data, const char* what)
    {
        if (!lends(data.size_bytes())) return upload(data, what);
        auto [memory, guard] = lent(data.data(), data.size_bytes());
        return Buffer<T>(std::move(memory), data.size(), std::move(guard));
    }
    // All elements, or `count` of them from `first` on.
    template <class T> std::vector<T> read(const Buffer<T>& buffer, std::size_t first = 0, std::size_t count = std::numeric_limits<std::size_t>::max())
    {
        std::vector<T> data(std::min(buffer.count() - first, count));
        read(buffer.memory(), data.data(), data.size() * sizeof(T), first * sizeof(T));
        return data;
    }

    // The same when the device is next waited for: `use` gets the elements then. Nothing is waited for now.
    template <class T, class Use> void read_later(const Buffer<T>& buffer, Use use)
    {
        auto data = std::make_shared<std::vector<T>>(buffer.count());
        read_later(buffer.memory(), data->data(), buffer.bytes(), [data, use = std::move(use)] { use(*data); });
    }

    // All of `from` to where `to` has its element `first`.
    template <class T> void copy(const Buffer<T>& from, const Buffer<T>& to, std::size_t first) { copy(from.memory(), to.memory(), from.bytes(), first * sizeof(T)); }

    // Runs a kernel over `global` items (rounded up to `local`, so kernels guard their range). Arguments: Buffers, cl::Buffers, or plain
    // values (float, int, cl_int2, structs shared with kernels); an empty Buffer is a null pointer. `bytes`: what it must move at the
    // least, for the report. Buffers must live until this returns; the driver holds them until the kernel is done. No items: no launch.
    // Throws too_large, with the numbers, for a work-group over the limits of kernel or device.
    template <class... Args> void launch(const Specialisation& specialisation, const char* kernel, std::array<std::size_t, 2> global,
                                         std::array<std::size_t, 2> local, std::uint64_t bytes, const Args&... args)
    {
        ensure_stage();
        launch(this->kernel(specialisation, kernel), kernel, global, local, bytes, args...);
    }
    // The same for a kernel object that nobody else uses.
    template <class... Args> void launch(cl::Kernel kernel, const char* name, std::array<std::size_t, 2> global,
                                         std::array<std::size_t, 2> local, std::uint64_t bytes, const Args&... args)
    {
        cl_uint index = 0;
        (set_argument(kernel, name, index++, args), ...);
        enqueue(kernel, name, global, local, bytes);
    }

    // Ends the running stage (waits for the device, unless the queue is the caller's) and starts one called `name`. Stages of the same name
    // are joined. What a stage spends building programs is taken out of it and reported as the stage "compile".
    void stage(const char* name);
    // While it lives the running stage goes on, whatever stage() says: what is called meanwhile then waits for the device nowhere.
    class OneStage {
    public:
        explicit OneStage(Work& work) : work_(work) { ++work_.held_; }
        ~OneStage() { --work_.held_; }
        OneStage(const OneStage&) = delete;
        OneStage& operator=(const OneStage&) = delete;

    private:
        Work& work_;
    };

    // Counts bytes that the running stage moved on the host.
    void moved(std::uint64_t bytes);
    // Ends the last stage and returns all; the next stage starts afresh. On the caller's queue device_ms is 0 for stages that are still
    // under way or not profiled. With canaries: Error(internal) when any buffer's guard tail was written to.
    std::vector<Stage> finish();

    // For kernels that may take long: an int that is not 0 when they are to leave out what they have not begun (common/stop.clh). A null
    // buffer where nobody can stop this work, or the device would not see it.
    cl::Buffer stop();

    // What building programs took since the last finish().
    double compile_ms() const { return total_compile_ms_ + compile_ms_; }

    MemoryMeter& memory() { return *memory_; }
    // Adds to another meter's account what stays alive (prepared state that this work builds upon).
    std::shared_ptr<MemoryMeter> memory_ptr() const { return memory_; }

private:
    void open(); // the device, where that waited
    // Throws Stopped: what kernels left out is not there.
    void check_stop() const;
    std::pair<cl::Buffer, std::shared_ptr<void>> allocate(std::uint64_t bytes, const char* what);
    bool lends(std::size_t bytes);
    std::pair<cl::Buffer, std::shared_ptr<void>> lent(const void* data, std::size_t bytes);
    void write(const cl::Buffer& memory, const void* data, std::size_t bytes);
    void copy(const cl::Buffer& from, const cl::Buffer& to, std::size_t bytes, std::size_t offset);
    void read(const cl::Buffer& memory, void* data, std::size_t bytes, std::size_t offset);
    void read_later(const cl::Buffer& memory, void* data, std::size_t bytes, std::function<void()> use);
    void use_read(); // what read_later asked for, once the device was waited for
    cl::Kernel kernel(const Specialisation& specialisation, const char* name); // one of this work's own
    void enqueue(cl::Kernel& kernel, const char* name, std::array<std::size_t, 2> global, std::array<std::size_t, 2> local,
                 std::uint64_t bytes);

    template <class T> void set_argument(cl::Kernel& kernel, const char* name, cl_uint index, const Buffer<T>& buffer)
    {
        set_argument_bytes(kernel, name, index, sizeof(cl_mem), &buffer.memory()());
    }
    void set_argument(cl::Kernel& kernel, const char* name, cl_uint index, const cl::Buffer& buffer)
    {
        set_argument_bytes(kernel, name, index, sizeof(cl_mem), &buffer());
    }
    template <class T>
    requires std::is_trivially_copyable_v<T>
    void set_argument(cl::Kernel& kernel, const char* name, cl_uint index, const T& value)
    {
        set_argument_bytes(kernel, name, index, sizeof(T), &value);
    }
    void set_argument_bytes(cl::Kernel& kernel, const char* name, cl_uint index, std::size_t bytes, const void* value);

    cl::Event* new_event(); // of the running stage; null on a queue without profiling
    void ensure_stage();    // work outside any stage counts as the stage "work"
    void end_stage();
    void add_device_times();
    void check_canaries();

    std::shared_ptr<const LateContext> late_; // null: `context_` was given
    std::shared_ptr<const Context> context_;  // null: nothing needed the device so far
    cl::CommandQueue queue_;
    bool own_queue_ = true, profiled_ = true;
    // The word as the device reads it, until nothing runs that may.
    struct StopBuffer {
        StopBuffer(std::shared_ptr<StopWord> asked, cl::Buffer seen, cl::CommandQueue used)
            : word(std::move(asked)), memory(std::move(seen)), queue(std::move(used))
        {
        }
        ~StopBuffer();
        std::shared_ptr<StopWord> word;
        cl::Buffer memory;
        cl::CommandQueue queue;
    };
    std::shared_ptr<StopWord> stop_ = current_stop();
    std::unique_ptr<StopBuffer> stop_buffer_;
    std::shared_ptr<MemoryMeter> memory_ = std::make_shared<MemoryMeter>();
    double compile_ms_ = 0, total_compile_ms_ = 0;
    std::vector<std::function<void()>> later_; // what read_later keeps until then
    struct OwnKernel {
        std::string file, name;
        std::vector<std::pair<std::string, std::string>> constants;
        cl::Kernel kernel;
    };
    std::vector<OwnKernel> kernels_;
    struct Launched {
        cl_kernel kernel;
        std::array<std::size_t, 2> local;
    };
    std::vector<Launched> launched_; // that need no more checks
    int held_ = 0;
    std::vector<Stage> stages_;
    std::vector<std::pair<std::size_t, cl::Event>> events_; // stage index, event
    std::size_t current_ = 0;
    bool running_ = false;
    std::chrono::steady_clock::time_point started_;
};

} // namespace penumbra::opencl
