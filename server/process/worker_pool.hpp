// The processes that decode, compute and encode: one a slot, of this same program. They may die; the service does not.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
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
    std::string program; // that is started with --worker=FOLDER and `arguments`, and has its channel at descriptor worker_channel
    std::vector<std::string> arguments;
    std::size_t workers = 2;
    std::chrono::milliseconds grace{500}; // beyond a request's deadline, until its worker is ended
};
constexpr int worker_channel = 3;

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
        Lease(Lease&& other) noexcept : pool_(other.pool_), worker_(std::exchange(other.worker_, nullptr)) {}
        Lease& operator=(Lease&&) = delete;
        ~Lease();

        // Sends the call and waits for its answer. Throws Problem: 504 when the deadline passes, and the worker is ended; 500 `crashed`
        // when it dies by itself; 503 when the service ends.
        Message call(std::string_view text, std::span<const int> files, const Deadline& deadline);
        // That the worker keeps what belongs to this name now, or does no longer.
        void keeps(const std::string& name);

    private:
        WorkerPool* pool_;
        Worker* worker_;
    };

    // Starts the first worker and waits for its greeting, the first message that a worker sends; the others start after it. Throws Problem
    // with its last words when it dies before.
    Message start();
    // A worker that is free, rather one that keeps what belongs to `name`. Waits. Throws Problem 503 when none becomes free in time.
    Lease lease(std::string_view name, const Deadline& deadline);
    // The worker of that number, from 0.
    Lease lease_number(std::size_t number, const Deadline& deadline);
    // Workers that keep what belongs to the name are told to forget it, before their next call: the text `forget` and the name.
    void forget(const std::string& name);
    // From now on nobody computes for longer than `time`: then calls end with Problem 503.
    void end_within(std::chrono::milliseconds time);

    struct Counts {
        std::size_t starting = 0, idle = 0, busy = 0;
        std::uint64_t started = 0, crashed = 0, overdue = 0; // so far; overdue: ended at a deadline
        Clock::duration since_finished{};                    // the last call
    };
    Counts counts() const;
    std::vector<pid_t> processes() const;

private:
    enum class State { dead, starting, idle, busy };
    bool over() const; // with the mutex: nobody computes any more
    void supervise();
    void spawn(Worker& worker);
    void bury_the_dead();
    void bury(Worker& worker, bool overdue);
    Worker* next_dead(Clock::time_point& when);
    void say_death(const Worker& worker, int status) const;
    std::string folder_of(const Worker& worker) const;

    const PoolOptions options_;
    const Say say_;
    const std::string folder_; // of temporary files, one below it for each worker; empty: none could be made
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::unique_ptr<Worker>> workers_;
    std::optional<Message> greeting_;
    std::exception_ptr no_greeting_;
    Counts counts_;
    Clock::time_point finished_ = Clock::now();
    Clock::time_point end_ = Clock::time_point::max();
    bool ending_ = false;
    std::thread supervisor_;
};

} // namespace penumbra::server
