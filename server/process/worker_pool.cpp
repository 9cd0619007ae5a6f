#include "process/worker_pool.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <penumbra/error.hpp>

#include "process/priority.hpp"
#include "process/problem.hpp"
#include "process/wait.hpp"
#include "process/watch.hpp"

namespace penumbra::server {
namespace {

// Between two starts of a worker that dies again and again.
constexpr std::chrono::milliseconds first_pause{100}, longest_pause{10000};

std::string death_of(int status)
{
    if (WIFSIGNALED(status)) return std::string("signal ") + std::to_string(WTERMSIG(status)) + " (" + strsignal(WTERMSIG(status)) + ")";
    return "exit code " + std::to_string(WEXITSTATUS(status));
}

// For this user alone; empty where there is no place for one.
std::string new_folder()
{
    std::error_code none;
    std::string pattern = (std::filesystem::temp_directory_path(none) / "penumbra-server-XXXXXX").string();
    return none || !mkdtemp(pattern.data()) ? std::string() : pattern;
}

} // namespace

struct WorkerPool::Worker {
    std::size_t number = 0;
    State state = State::dead;
    pid_t process = 0;
    Channel channel;
    std::set<std::string, std::less<>> keeps;
    std::vector<std::string> to_forget;
    Clock::time_point not_before = Clock::time_point::min(), used = Clock::time_point::min();
    std::chrono::milliseconds pause{0};
};

WorkerPool::WorkerPool(PoolOptions options, Say say)
    : options_(std::move(options)), say_(std::move(say)), folder_(new_folder()), raises_(may_raise_priority())
{
    for (std::size_t i = 0; i < options_.workers; ++i) {
        workers_.push_back(std::make_unique<Worker>());
        workers_.back()->number = i;
    }
}

WorkerPool::~WorkerPool()
{
    {
        const std::scoped_lock lock(mutex_);
        ending_ = true;
        end_ = Clock::now();
    }
    changed_.notify_all();
    if (supervisor_.joinable()) supervisor_.join();
    // What they have is gone with them: to let drivers and compilers tidy up would only take time.
    for (const auto& worker : workers_)
        if (worker->process > 0) kill(worker->process, SIGKILL);
    for (const auto& worker : workers_) {
        int status = 0;
        while (worker->process > 0 && waitpid(worker->process, &status, 0) < 0 && errno == EINTR) {
        }
    }
    // A thousand files take longer than the end may: by a process that stays for that.
    if (!folder_.empty()) remove_later();
}

void WorkerPool::remove_later() const
{
    std::string program = options_.program, word = "--remove=" + folder_;
    const std::array<char*, 3> words{program.data(), word.data(), nullptr};
    pid_t process = 0;
    std::error_code ignored; // there is nobody to tell
    if (posix_spawn(&process, options_.program.c_str(), nullptr, nullptr, words.data(), environ) != 0) std::filesystem::remove_all(folder_, ignored);
}

std::string WorkerPool::folder_of(const Worker& worker) const
{
    return folder_.empty() ? std::string() : folder_ + "/" + std::to_string(worker.number);
}

std::string WorkerPool::start()
{
    std::unique_lock lock(mutex_);
    supervisor_ = std::thread([this] { supervise(); });
    changed_.wait(lock, [&] { return !greeting_.empty() || failure_; });
    if (greeting_.empty()) std::rethrow_exception(failure_);
    return greeting_;
}

void WorkerPool::wait_until_warm(std::size_t workers)
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return warmed_ >= workers || failure_ || over(); });
    if (over()) throw service_ends();
    if (failure_) std::rethrow_exception(failure_);
}

// Starts the builder, then dead workers, two at a time: a start is the work of one processor, for a second or so.
void WorkerPool::supervise()
{
    build();
    std::thread second([this] { start_the_dead(); });
    start_the_dead();
    second.join();
}

void WorkerPool::start_the_dead()
{
    constexpr std::chrono::milliseconds look{100}; // for those that died idle
    std::unique_lock lock(mutex_);
    while (!ending_) {
        bury_the_dead();
        for (const std::string& folder : std::exchange(left_, {})) {
            lock.unlock();
            std::error_code ignored; // it goes with all of them
            std::filesystem::remove_all(folder, ignored);
            lock.lock();
        }
        Clock::time_point when = Clock::time_point::max();
        Worker* const worker = !failure_ && !over() ? next_dead(when) : nullptr;
        if (!worker) {
            changed_.wait_until(lock, std::min(when, Clock::now() + look));
            continue;
        }
        worker->state = State::starting;
        lock.unlock();
        const std::exception_ptr failure = bring_up(*worker, false);
        lock.lock();
        if (failure) {
            bury(*worker, End::crashed);
            if (warmed_ == 0) failure_ = failure;
        } else {
            worker->state = State::idle;
            ++counts_.started;
            ++warmed_;
        }
        changed_.notify_all();
    }
}

// A process of its own, which ends before anybody asks for anything. It alone may write to the folder of kernels that all share.
void WorkerPool::build()
{
    Worker builder;
    builder.number = options_.workers;
    const std::exception_ptr failure = bring_up(builder, true);
    builder.channel = Channel(); // it ends when its channel does, and what it has to say of the kernels is said
    for (const auto end = Clock::now() + std::chrono::seconds(5); !failure && Clock::now() < end && ::poll(nullptr, 0, 5) == 0;) {
        siginfo_t ended{};
        if (waitid(P_PID, static_cast<id_t>(builder.process), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 || ended.si_pid != 0) break;
    }
    const std::scoped_lock lock(mutex_);
    if (failure) failure_ = failure;
    bury(builder, failure ? End::crashed : End::retired);
    changed_.notify_all();
}

// With the mutex: whether more are free than are missing.
bool WorkerPool::has_time() const
{
    const auto in = [&](auto... states) {
        return std::ranges::count_if(workers_, [&](const auto& worker) { return ((worker->state == states) || ...); });
    };
    return in(State::idle) > in(State::dead, State::starting);
}

// Waits for a message of one that starts. The end of the service ends the wait too. Where it is not missed it leaves its time to the others.
void WorkerPool::await(Worker& worker, Message& message, bool& lowered)
{
    constexpr int steps = 10; // of nice(2): a ninth of what the others get, where they want all
    for (;;) {
        const auto got = worker.channel.receive(message, Clock::now() + std::chrono::milliseconds(50));
        if (got == Channel::Got::message) return;
        const std::scoped_lock lock(mutex_);
        if (over()) throw service_ends();
        if (got == Channel::Got::ended) throw Problem(503, "no_worker", "a worker ended before it was ready");
        if (raises_ && has_time() != lowered) {
            lowered = !lowered;
            lower_priority(worker.process, lowered ? steps : 0);
        }
    }
}

// Gives what kept it from being ready.
std::exception_ptr WorkerPool::bring_up(Worker& worker, bool builder)
{
    try {
        bool lowered = false;
        spawn(worker, builder);
        Message message;
        await(worker, message, lowered);
        if (builder) {
            const std::scoped_lock lock(mutex_);
            greeting_ = message.text;
            changed_.notify_all();
        }
        if (!options_.warm.empty()) {
            if (!worker.channel.send(options_.warm)) throw Problem(503, "no_worker", "a worker ended before it was warm");
            await(worker, message, lowered);
            options_.warmed(message);
        }
        if (lowered) lower_priority(worker.process, 0);
        return nullptr;
    } catch (...) {
        return std::current_exception();
    }
}

WorkerPool::Worker* WorkerPool::next_dead(Clock::time_point& when)
{
    for (const auto& worker : workers_) {
        if (worker->state != State::dead) continue;
        if (worker->not_before <= Clock::now()) return worker.get();
        when = std::min(when, worker->not_before);
    }
    return nullptr;
}

void WorkerPool::spawn(Worker& worker, bool builder)
{
    auto [ours, theirs] = Channel::pair();
    const std::string folder = folder_of(worker);
    std::error_code ignored; // a worker without a folder takes no meshes, and says so
    if (!folder.empty()) std::filesystem::create_directory(folder, ignored);
    if (!builder) options_.furnish(folder, greeting_);
    std::vector<std::string> words{options_.program, (builder ? "--builder=" : "--worker=") + folder};
    words.insert(words.end(), options_.arguments.begin(), options_.arguments.end());
    std::vector<char*> pointers;
    pointers.reserve(words.size() + 1);
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    // dup2 to itself would leave it to be closed at exec.
    Descriptor other;
    if (theirs.descriptor() == worker_channel) other = Descriptor(fcntl(worker_channel, F_DUPFD_CLOEXEC, worker_channel + 1));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, other ? other.get() : theirs.descriptor(), worker_channel);
    posix_spawn_file_actions_addclosefrom_np(&actions, worker_channel + 1);
    pid_t process = 0;
    const int wrong = posix_spawn(&process, options_.program.c_str(), &actions, nullptr, pointers.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (wrong != 0)
        throw Error(ErrorCode::device, options_.program + ": no worker can be started: " + std::generic_category().message(wrong));
    const std::scoped_lock lock(mutex_);
    worker.process = process;
    worker.channel = std::move(ours);
}

// With the mutex. The process ends, its place is free to be taken again. Gives how it ended: one that ended at its deadline by itself is retired.
WorkerPool::End WorkerPool::bury(Worker& worker, End end)
{
    if (worker.process > 0) {
        kill(worker.process, SIGKILL);
        int status = 0;
        while (waitpid(worker.process, &status, 0) < 0 && errno == EINTR) {
        }
        if (end == End::crashed && WIFEXITED(status) && WEXITSTATUS(status) == ended_at_deadline) end = End::retired;
        if (end == End::overdue)
            ++counts_.overdue;
        else if (end == End::crashed && !over()) {
            ++counts_.crashed;
            say_death(worker, status);
        }
    }
    std::error_code ignored;
    if (!folder_.empty()) { // what it has left there is removed while nobody waits
        left_.push_back(folder_ + "/left-" + std::to_string(++counts_.buried));
        std::filesystem::rename(folder_of(worker), left_.back(), ignored);
    }
    worker.process = 0;
    worker.channel = Channel();
    worker.keeps.clear();
    worker.to_forget.clear();
    worker.state = State::dead;
    // One that served for a while starts again at once.
    const bool young = end == End::crashed && worker.used == Clock::time_point::min();
    worker.pause = young ? std::clamp(worker.pause * 2, first_pause, longest_pause) : std::chrono::milliseconds(0);
    worker.not_before = Clock::now() + worker.pause;
    worker.used = Clock::time_point::min();
    return end;
}

// With the mutex. Those that died while nobody asked them for anything: an idle one never says a word, so that its channel has one to read
// only when it has ended. What is asked next is not to blame.
void WorkerPool::bury_the_dead()
{
    for (const auto& worker : workers_) {
        if (worker->state != State::idle) continue;
        pollfd channel{worker->channel.descriptor(), POLLIN, 0};
        if (::poll(&channel, 1, 0) <= 0) continue;
        bury(*worker, End::crashed);
        changed_.notify_all();
    }
}

void WorkerPool::say_death(const Worker& worker, int status) const
{
    say_("warning: worker " + std::to_string(worker.number) + " ended by " + death_of(status) + "; it starts again");
}

WorkerPool::Lease WorkerPool::lease(std::string_view name, const Deadline& deadline)
{
    std::unique_lock lock(mutex_);
    Worker* best = nullptr;
    const auto better = [&](const Worker& a, const Worker& b) {
        const bool a_keeps = !name.empty() && a.keeps.contains(name), b_keeps = !name.empty() && b.keeps.contains(name);
        if (a_keeps != b_keeps) return a_keeps;
        return a.keeps.size() != b.keeps.size() ? a.keeps.size() < b.keeps.size() : a.used > b.used; // rather the one whose memory is warm
    };
    const auto found = [&] {
        bury_the_dead();
        best = nullptr;
        for (const auto& worker : workers_)
            if (worker->state == State::idle && (!best || better(*worker, *best))) best = worker.get();
        return best || over();
    };
    if (!changed_.wait_until(lock, deadline.end(), found) || over()) {
        if (over()) throw service_ends();
        throw Problem(503, "no_worker", "no worker was free in time; they are being started again", 1);
    }
    best->state = State::busy;
    return {*this, *best};
}

WorkerPool::Lease::~Lease()
{
    if (!worker_) return;
    give_back();
    pool_->changed_.notify_all();
}

void WorkerPool::Lease::give_back()
{
    const std::scoped_lock lock(pool_->mutex_);
    if (worker_->state != State::busy) return;
    worker_->state = State::idle;
    // One whose priority stays low serves nobody well any more.
    const bool stays_low = lowered_ && !(pool_->raises_ && lower_priority(worker_->process, 0));
    if (retired_ || stays_low) pool_->bury(*worker_, End::retired);
}

// Waits for the answer. The longer it takes, the more it leaves to others.
Channel::Got WorkerPool::Lease::wait(Message& answer, const Deadline& deadline, const std::function<bool()>& is_long)
{
    const auto begun = Clock::now();
    const auto used_before = processor_time(worker_->process);
    auto step = steps_down.begin();
    bool said = !is_long, hurried = false;
    for (;;) {
        const auto now = Clock::now();
        Clock::time_point end = deadline.end() == Clock::time_point::max() ? deadline.end() : deadline.end() + pool_->options_.grace;
        {
            const std::scoped_lock lock(pool_->mutex_);
            end = std::min(end, pool_->end_);
        }
        if (now >= end) return Channel::Got::late;
        // It is to stop now, and to say so within the grace: not on what the others leave.
        if (now >= deadline.end() && !hurried) {
            hurried = true;
            step = steps_down.end();
            if (lowered_ && pool_->raises_) lower_priority(worker_->process, 0);
        }
        if (!hurried) end = std::min(end, deadline.end());
        end = std::min(end, now + std::chrono::milliseconds(100)); // the service's end is looked for now and then: it shortens the wait
        if (step != steps_down.end()) {
            const auto left = step->after - (processor_time(worker_->process) - used_before);
            if (left <= Clock::duration::zero()) {
                lower_priority(worker_->process, step++->steps);
                lowered_ = true;
            } else {
                end = std::min(end, now + std::max<Clock::duration>(left, std::chrono::milliseconds(10)));
            }
        }
        if (!said && now - begun >= long_call) said = is_long();
        if (!said) end = std::min(end, std::max(begun + long_call, now + std::chrono::milliseconds(10)));
        const auto got = worker_->channel.receive(answer, end);
        if (got != Channel::Got::late) return got;
    }
}

Message WorkerPool::Lease::call(std::string_view text, std::span<const int> files, const Deadline& deadline,
                                const std::function<bool()>& is_long)
{
    Worker& worker = *worker_;
    std::vector<std::string> to_forget;
    {
        const std::scoped_lock lock(pool_->mutex_);
        if (worker.state != State::busy) throw Problem(503, "no_worker", "the worker is gone", 1);
        to_forget.swap(worker.to_forget);
    }
    bool there = true;
    for (const std::string& name : to_forget) there = there && worker.channel.send("forget" + name);
    there = there && worker.channel.send(text, files);
    Message answer;
    const auto got = there ? wait(answer, deadline, is_long) : Channel::Got::ended;
    const std::scoped_lock lock(pool_->mutex_);
    if (got == Channel::Got::message) {
        worker.used = pool_->finished_ = Clock::now();
        return answer;
    }
    const bool late = got == Channel::Got::late, ended = Clock::now() >= pool_->end_;
    const End end = pool_->bury(worker, late ? End::overdue : End::crashed);
    pool_->changed_.notify_all();
    if (ended) throw service_ends();
    if (late) throw deadline.over();
    if (end == End::retired) throw deadline.over_compiling();
    throw Problem(500, "crashed", "the process that computed this ended; others in flight did not notice. The log has the request's digest");
}

void WorkerPool::Lease::keeps(const std::string& name)
{
    const std::scoped_lock lock(pool_->mutex_);
    if (worker_->state == State::busy) worker_->keeps.insert(name);
}

void WorkerPool::forget(const std::string& name)
{
    const std::scoped_lock lock(mutex_);
    for (const auto& worker : workers_) {
        if (worker->keeps.erase(name) == 0) continue;
        if (worker->state == State::idle)
            worker->channel.send("forget" + name);
        else
            worker->to_forget.push_back(name);
    }
}

void WorkerPool::end_within(std::chrono::milliseconds time)
{
    const std::scoped_lock lock(mutex_);
    end_ = std::min(end_, Clock::now() + time);
    changed_.notify_all();
}

bool WorkerPool::over() const { return ending_ || Clock::now() >= end_; }

WorkerPool::Counts WorkerPool::counts() const
{
    const std::scoped_lock lock(mutex_);
    Counts counts = counts_;
    for (const auto& worker : workers_) {
        counts.starting += worker->state == State::dead || worker->state == State::starting;
        counts.idle += worker->state == State::idle;
        counts.busy += worker->state == State::busy;
    }
    counts.since_finished = Clock::now() - finished_;
    return counts;
}

std::vector<pid_t> WorkerPool::processes() const
{
    const std::scoped_lock lock(mutex_);
    std::vector<pid_t> all;
    for (const auto& worker : workers_)
        if (worker->process > 0) all.push_back(worker->process);
    return all;
}

} // namespace penumbra::server
