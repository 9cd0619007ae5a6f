// The processes that decode, compute and encode: one a slot, of this same program. They may die; the service does not.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <sys/types.h>

#include "process/channel.hpp"
#include "process/gate.hpp"

namespace penumbra::server {

struct PoolOptions {
    // That is started with --worker=FOLDER and `arguments`, and has its channel at descriptor worker_channel. Its first message is its greeting.
    // The first process of all gets --builder=FOLDER instead.
    std::string program;
    std::vector<std::string> arguments;
    std::size_t workers = 2;
    std::chrono::milliseconds grace{500}; // beyond a request's deadline, until its worker is ended
    std::string warm;                     // the first call to each, before it counts as free
    std::function<void(const Message& answer)> warmed = [](const Message&) {};         // looks at what came back; throws
    // Fills a worker's folder before it starts; the text is the first process's greeting. Throws.
    std::function<void(const std::string& folder, const std::string& greeting)> furnish = [](const std::string&, const std::string&) {};
};
constexpr int worker_channel = 3;

// From what use of the processors on a worker gives way to the others: the lower, the more. By the clock, who waits for others would be lowered
// for it.
struct Step {
    std::chrono::milliseconds after; // of all processors together
    int steps;                       // of nice(2)
};
constexpr std::array<Step, 4> steps_down{{{std::chrono::milliseconds(125), 3}, {std::chrono::milliseconds(250), 6}, {std::chrono::milliseconds(500), 10},
                                           {std::chrono::milliseconds(1000), 12}}};
constexpr std::chrono::milliseconds long_call{250}; // by the clock: then it goes on beside the slots, if it may

class WorkerPool {
public:
    using Clock = std::chrono::steady_clock;
    using Say = std::function<void(std::string_view line)>; // called from many threads

    WorkerPool(PoolOptions options, Say say);
    // Ends what still computes.
    ~WorkerPool();
    WorkerPool(const WorkerPool&) = delete;
    WorkerPool& operator=(const WorkerPool&) = delete;

private:
    struct Worker;

public:
    // One worker for one call; given back when this goes.
    class Lease {
    public:
        Lease(WorkerPool& pool, Worker& worker) : pool_(&pool), worker_(&worker) {}
        Lease(Lease&& other) noexcept
            : pool_(other.pool_), worker_(std::exchange(other.worker_, nullptr)), lowered_(other.lowered_), retired_(other.retired_)
        {
        }
        Lease& operator=(Lease&&) = delete;
        ~Lease();

        // Sends the call and waits for its answer. `is_long` is called from long_call on, now and then until it says true. Throws Problem:
        // 504 when the deadline passes, and the worker is ended; 500 `crashed` when it dies by itself; 503 when the service ends.
        Message call(std::string_view text, std::span<const int> files, const Deadline& deadline, const std::function<bool()>& is_long = {});
        // That the worker keeps what belongs to this name now, or does no longer.
        void keeps(const std::string& name);
        // That it is to end when it is given back; another takes its place.
        void retire() { retired_ = true; }

    private:
        void give_back();
        Channel::Got wait(Message& answer, const Deadline& deadline, const std::function<bool()>& is_long);

        WorkerPool* pool_;
        Worker* worker_;
        bool lowered_ = false, retired_ = false;
    };

    // Starts a process that builds what is missing, waits for its greeting, and gives that. It ends when it is warm, and the workers start. Throws
    // Problem when it dies before.
    std::string start();
    // Waits until so many workers have been warmed. Throws what kept the first of them from it, and Problem 503 when the service ends.
    void wait_until_warm(std::size_t workers);
    // A worker that is free, rather one that keeps what belongs to `name`. Waits. Throws Problem 503 when none becomes free in time.
    Lease lease(std::string_view name, const Deadline& deadline);
    // Workers that keep what belongs to the name are told to forget it, before their next call: the text `forget` and the name.
    void forget(const std::string& name);
    // From now on nobody computes for longer than `time`: then calls end with Problem 503.
    void end_within(std::chrono::milliseconds time);

    struct Counts {
        std::size_t starting = 0, idle = 0, busy = 0;
        std::uint64_t started = 0, crashed = 0, overdue = 0, buried = 0; // so far; overdue: did not stop at a deadline; buried: all that ended
        Clock::duration since_finished{};                    // the last call
    };
    Counts counts() const;
    std::vector<pid_t> processes() const;

private:
    enum class State { dead, starting, idle, busy };
    enum class End { crashed, overdue, retired };
    bool over() const; // with the mutex: nobody computes any more
    void supervise();
    void build();
    void start_the_dead();
    std::exception_ptr bring_up(Worker& worker, bool builder);
    void await(Worker& worker, Message& message, bool& lowered);
    bool has_time() const;
    void spawn(Worker& worker, bool builder);
    void bury_the_dead();
    End bury(Worker& worker, End end);
    Worker* next_dead(Clock::time_point& when);
    void say_death(const Worker& worker, int status) const;
    std::string folder_of(const Worker& worker) const;
    void remove_later() const;

    const PoolOptions options_;
    const Say say_;
    const std::string folder_; // of temporary files, one below it for each worker; empty: none could be made
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::unique_ptr<Worker>> workers_;
    std::vector<std::string> left_; // folders of workers that ended
    std::string greeting_; // of the builder, once it has come
    std::exception_ptr failure_; // of the first processes: there will be no worker
    std::size_t warmed_ = 0;
    const bool raises_; // a priority that was lowered
    Counts counts_;
    Clock::time_point finished_ = Clock::now();
    Clock::time_point end_ = Clock::time_point::max();
    bool ending_ = false;
    std::thread supervisor_;
};

} // namespace penumbra::server
