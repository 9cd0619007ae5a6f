// Where connections are while no thread needs to be with them: until a request's headers are whole, while an answer waits for its client,
// and while what a refused client still sends is read and forgotten.
//
// One thread looks after all of them, so that clients who trickle, idle or do not take their answers cost a descriptor and some bytes,
// never one of the threads that answer requests.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>

namespace penumbra::server {

struct LobbyLimits {
    std::size_t connections = 512; // open at a time
    std::chrono::steady_clock::duration header_time = std::chrono::seconds(5);
    std::size_t header_bytes = 16384; // request line and headers together
    std::uint64_t answer_bytes = std::uint64_t{256}
                                 << 20; // of all answers that wait for their clients; beyond, the one that waits longest is given up
    std::size_t forget_bytes = std::size_t{4} << 20; // of a refused request, read so that its sender gets the answer
    // The slowest transfer that is waited for: after `transfer_grace` a body, or an answer, has to have moved on at this on average.
    std::uint64_t slowest_transfer = 16384; // bytes a second

    // When a transfer that began at `begin` and has moved `bytes` is too slow.
    std::chrono::steady_clock::time_point transfer_end(std::chrono::steady_clock::time_point begin, std::uint64_t bytes) const;
};
constexpr std::chrono::seconds transfer_grace{5};

// A connection whose headers are here, or will never be.
struct Arrival {
    int socket = -1;
    std::chrono::steady_clock::time_point begun; // when it was accepted
    std::string bytes;                           // request line, headers, and what came of the body
    bool timed_out = false;
    bool ended = false; // the client sends no more
};

class Lobby {
public:
    using Clock = std::chrono::steady_clock;
    // `serve` gets each socket with its bytes, from the lobby's thread; it must neither block nor call the lobby.
    using Serve = std::function<void(Arrival)>;

    // No more than limits.connections are open at a time, those that are served included. One more pushes out the oldest that has waited
    // for its headers for a second, or that is being forgotten; when there is none, it waits where the kernel keeps it.
    Lobby(const LobbyLimits& limits, Serve serve);
    ~Lobby();
    Lobby(const Lobby&) = delete;
    Lobby& operator=(const Lobby&) = delete;

    // Waits for a place.
    void arrive(int socket);
    // Sends `rest`, ends its own side, then reads and forgets what the client still sends when `unread`; closes.
    void leave(int socket, std::string rest, bool unread);

    // Returns when every connection that arrived was served; arrivals from then on are not allowed.
    void wait_for_arrivals();
    // Returns when all have left.
    void wait_for_leaving();

    // No guest stays longer, and no body is waited for.
    void end_by(Clock::time_point end);
    Clock::time_point end() const { return end_; }

    std::size_t connections() const; // those that are open
    const LobbyLimits& limits() const { return limits_; }

private:
    enum class Phase { headers, sending, forgetting };
    struct Guest {
        Phase phase = Phase::headers;
        Clock::time_point begun, phase_begun;
        std::string bytes; // came, or are to be sent
        std::size_t done = 0;
        bool unread = false;
    };
    using Guests = std::unordered_map<int, Guest>;

    void run();
    void wake() const;
    Clock::time_point end_of(const Guest& guest) const;
    Clock::time_point end_of_phase(const Guest& guest) const;
    void begin_phase(Guests::iterator entry, Phase phase, bool watched);
    void move_on(Guests::iterator guest);
    void read_headers(Guests::iterator guest);
    void send(Guests::iterator entry);
    void forget(Guests::iterator guest);
    void begin_forgetting(Guests::iterator entry);
    void hand_over(Guests::iterator guest, bool timed_out, bool ended);
    void end_late(Clock::time_point now);
    bool make_room();
    static Clock::time_point may_go(const Guest& guest);
    Clock::time_point next_room() const;
    void give_up_an_answer();
    void close(Guests::iterator guest);
    void watch(int socket, Phase phase, bool watched) const;

    const LobbyLimits limits_;
    const Serve serve_;
    const int events_, wake_; // an epoll descriptor, and an eventfd in its set
    mutable std::mutex mutex_;
    std::condition_variable changed_; // a guest left, was handed over, or began another phase
    Guests guests_;
    Clock::time_point next_end_ = Clock::time_point::max(); // no guest's time is up before
    std::size_t served_ = 0;                                // handed over and not back
    std::uint64_t waiting_bytes_ = 0;                       // of answers
    bool ending_ = false;
    std::atomic<Clock::time_point> end_ = Clock::time_point::max(); // of all guests
    std::thread thread_;
};

} // namespace penumbra::server
