// Requests over cpp-httplib: one connection each (the service closes it), a deadline for the whole exchange, and retries.
#pragma once

// Debian's cpp-httplib is a compiled library whose classes have other members with and without these macros: a program that is compiled
// without them crashes. pkg-config cpp-httplib has them.
#if !defined(CPPHTTPLIB_OPENSSL_SUPPORT) && !defined(PENUMBRA_CLIENT_PLAIN_HTTPLIB)
#error                                                                                                                                     \
    "compile with the flags of `pkg-config --cflags cpp-httplib`; or define PENUMBRA_CLIENT_PLAIN_HTTPLIB for a header-only copy without TLS"
#endif

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <ctime>
#include <initializer_list>
#include <iomanip>
#include <locale>
#include <mutex>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <poll.h>
#include <sys/socket.h>

#include <httplib.h>
#include <nlohmann/json.hpp>

#include <penumbra/client/errors.hpp>
#include <penumbra/client/images.hpp>

namespace penumbra::client {

struct Options {
    std::string token;                        // what the service was given as its token; empty: none
    std::chrono::milliseconds timeout{60000}; // for one whole attempt
    int retries = 4;                          // further attempts after 503 and when no connection came about; nothing else is tried again
    std::chrono::milliseconds backoff{250};   // before the first retry; doubles up to 8 s, less up to a half by chance
    std::string traceparent;                  // W3C trace context, sent with every request; empty: none
};

namespace detail {

constexpr double max_backoff_s = 8, max_retry_after_s = 60; // a service that asks for more is not waited for

struct Url {
    std::string origin, path; // "http://host:port" and what comes before /v1, without a / at the end
};

inline Url parse_url(const std::string& url)
{
    const std::size_t host = url.starts_with("http://") ? 7 : url.starts_with("https://") ? 8 : std::string::npos;
    const std::size_t end = host == std::string::npos ? host : std::min(url.find('/', host), url.size());
    if (end == std::string::npos || end == host || url.find_first_of("?#@ \t\r\n") != std::string::npos)
        throw std::invalid_argument("url \"" + url + "\" (expected http://HOST[:PORT][/PATH] or https://...)");
    Url parsed{url.substr(0, end), url.substr(end)};
    while (parsed.path.ends_with('/')) parsed.path.pop_back();
#ifndef CPPHTTPLIB_OPENSSL_SUPPORT
    if (host == 8) throw std::invalid_argument("url \"" + url + "\": this program is built without TLS");
#endif
    return parsed;
}

struct Body {
    std::string bytes, media_type;
};

// multipart/form-data. The boundary is random and in no part.
inline Body form(const std::string& scene, const Images& images)
{
    std::random_device random;
    std::string boundary;
    const auto inside = [&](const std::string& bytes) { return bytes.find(boundary) != std::string::npos; };
    do {
        boundary = "penumbra-";
        for (int i = 0; i < 4; ++i) boundary += std::to_string(random());
    } while (inside(scene) || std::ranges::any_of(images, [&](const auto& image) { return inside(image.second); }));

    Body body{{}, "multipart/form-data; boundary=" + boundary};
    const auto add = [&](const std::string& name, const std::string& bytes) {
        body.bytes += "--" + boundary + "\r\nContent-Disposition: form-data; name=\"" + name + "\"; filename=\"" + name + "\"\r\n\r\n";
        body.bytes += bytes;
        body.bytes += "\r\n";
    };
    add("scene", scene);
    for (const auto& [name, bytes] : images) {
        if (!is_part_name(name))
            throw std::invalid_argument("image \"" + name +
                                        "\" (expected 1 to 128 of A-Z a-z 0-9 . _ - with no . at the start, not \"scene\")");
        if (bytes.empty()) throw std::invalid_argument("image \"" + name + "\": is empty");
        add(name, bytes);
    }
    body.bytes += "--" + boundary + "--\r\n";
    return body;
}

// A connection that the other side has closed must not end the process: cpp-httplib writes without MSG_NOSIGNAL. Blocks SIGPIPE in this
// thread, and takes one that came meanwhile.
class NoBrokenPipe {
public:
    NoBrokenPipe()
    {
        sigemptyset(&pipe_);
        sigaddset(&pipe_, SIGPIPE);
        sigset_t pending;
        sigpending(&pending);
        pending_before_ = sigismember(&pending, SIGPIPE) == 1;
        pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
    }
    ~NoBrokenPipe()
    {
        const timespec at_once{};
        if (!pending_before_) sigtimedwait(&pipe_, nullptr, &at_once);
        pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    }
    NoBrokenPipe(const NoBrokenPipe&) = delete;
    NoBrokenPipe& operator=(const NoBrokenPipe&) = delete;

private:
    sigset_t pipe_{}, before_{};
    bool pending_before_ = false;
};

// Ends a client's request when the time is up: cpp-httplib times each read, and a service that trickles would never end.
class Watch {
public:
    Watch(httplib::Client& client, std::chrono::milliseconds timeout)
        : at_(std::chrono::steady_clock::now() + timeout), thread_([this, &client] {
              std::unique_lock lock(mutex_);
              if (!done_.wait_until(lock, at_, [this] { return over_; })) client.stop();
          })
    {
    }
    ~Watch() { end(); }
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    // Whether the time was up. By the clock: cpp-httplib's own timeouts end a read in the same moment, often before this thread does.
    bool end()
    {
        const bool up = std::chrono::steady_clock::now() >= at_;
        if (thread_.joinable()) {
            {
                const std::lock_guard lock(mutex_);
                over_ = true;
            }
            done_.notify_one();
            thread_.join();
        }
        return up;
    }

private:
    const std::chrono::steady_clock::time_point at_;
    std::mutex mutex_;
    std::condition_variable done_;
    bool over_ = false;
    std::thread thread_; // last: it uses the others
};

// Seconds, from a number of seconds or a date; nothing for neither.
inline std::optional<double> retry_after_s(const std::string& text)
{
    unsigned seconds = 0;
    if (parse(std::string_view(text), seconds)) return seconds;
    std::tm date{};
    std::istringstream in(text);
    in.imbue(std::locale::classic());
    if (!(in >> std::get_time(&date, "%a, %d %b %Y %H:%M:%S GMT"))) return {};
    return std::max(0.0, std::difftime(timegm(&date), std::time(nullptr)));
}

inline std::string text_at(const nlohmann::json& object, const char* key)
{
    if (!object.is_object()) return {};
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

// What an answer that is no success says: its problem+json, or what there is of it.
inline Problem problem_of(const httplib::Response& answer)
{
    const nlohmann::json json = nlohmann::json::parse(answer.body, nullptr, false);
    Problem problem{answer.status, text_at(json, "detail"), text_at(json, "reason"), text_at(json, "request_id"),
                    retry_after_s(answer.get_header_value("Retry-After"))};
    problem.path = text_at(json, "path");
    if (problem.request_id.empty()) problem.request_id = answer.get_header_value("X-Request-Id");
    if (problem.detail.empty()) {
        problem.detail = "an answer without a problem description";
        for (char c : answer.body.substr(0, 200)) {
            if (problem.detail.size() == 39) problem.detail += ": ";
            problem.detail += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
        }
    }
    return problem;
}

[[noreturn]] inline void broken(const httplib::Response& answer, const std::string& what)
{
    throw ServerError(
        Problem{answer.status, "the answer cannot be used: " + what, "broken_answer", answer.get_header_value("X-Request-Id"), {}});
}

// An answer that comes while the body is still being sent: the service refuses it by its headers, and closes after a while whether it was
// read or not. cpp-httplib would report no more than a failed write. Read to its end or that of the connection; only without TLS.
inline std::optional<httplib::Response> early_answer(socket_t socket)
{
    constexpr std::size_t longest = 1 << 20; // a problem has some hundred bytes
    std::string text;
    std::array<char, 4096> piece{};
    for (;;) {
        const ssize_t got = ::recv(socket, piece.data(), piece.size(), 0);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0 || text.size() > longest) break;
        text.append(piece.data(), static_cast<std::size_t>(got));
    }
    const std::size_t head = text.find("\r\n\r\n");
    if (!text.starts_with("HTTP/1.") || head == std::string::npos) return {};
    httplib::Response answer;
    if (text.size() < 12 || !parse(std::string_view(text).substr(9, 3), answer.status)) return {};
    std::istringstream lines(text.substr(0, head));
    std::string line;
    std::getline(lines, line); // the status
    while (std::getline(lines, line)) {
        if (line.ends_with('\r')) line.pop_back();
        const std::size_t colon = std::min(line.find(':'), line.size());
        const std::size_t value = std::min(line.find_first_not_of(": ", colon), line.size());
        answer.headers.emplace(line.substr(0, colon), line.substr(value));
    }
    answer.body = text.substr(head + 4);
    return answer;
}

class Transport {
public:
    Transport(const std::string& url, Options options) : url_(parse_url(url)), options_(std::move(options))
    {
        if (options_.timeout.count() <= 0) throw std::invalid_argument("timeout: expected more than 0");
        if (options_.retries < 0) throw std::invalid_argument("retries: expected 0 or more");
        if (options_.token.find_first_of("\r\n") != std::string::npos) throw std::invalid_argument("token: has a line's end in it");
    }

    // The answer, whose status is one of `accepted`; otherwise throws.
    httplib::Response ask(const std::string& method, const std::string& path, const Body* body, const httplib::Headers& headers,
                          std::initializer_list<int> accepted) const
    {
        for (int attempt = 0;; ++attempt) {
            const bool last = attempt == options_.retries;
            double wait_s = 0;
            try {
                httplib::Response answer = once(method, path, body, headers);
                if (std::ranges::find(accepted, answer.status) != accepted.end()) return answer;
                fail(problem_of(answer));
            } catch (const Overloaded& error) {
                wait_s = error.problem().retry_after_s.value_or(0);
                if (last || wait_s > max_retry_after_s) throw;
            } catch (const ConnectionFailed& error) {
                if (last || error.problem().reason != "connect") throw;
            }
            // Never sooner than asked; the jitter on top keeps clients apart that were refused together.
            std::this_thread::sleep_for(std::chrono::duration<double>(wait_s + pause_s(attempt)));
        }
    }

    // One attempt; any status is an answer.
    httplib::Response once(const std::string& method, const std::string& path, const Body* body, httplib::Headers headers) const
    {
        const NoBrokenPipe no_broken_pipe;
        httplib::Client client(url_.origin);
        if (!client.is_valid()) throw std::invalid_argument("url \"" + url_.origin + "\" (expected http://HOST[:PORT] or https://...)");
        client.set_connection_timeout(options_.timeout);
        client.set_read_timeout(options_.timeout);
        client.set_write_timeout(options_.timeout);
        if (!options_.token.empty()) headers.emplace("Authorization", "Bearer " + options_.token);
        if (!options_.traceparent.empty()) headers.emplace("traceparent", options_.traceparent);

        Watch watch(client, options_.timeout);
        const std::string at = url_.path + path;
        std::optional<httplib::Response> early;
        const auto send = [&](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
            pollfd entry{client.socket(), POLLIN, 0};
            if (url_.origin.starts_with("http://") && ::poll(&entry, 1, 0) > 0) {
                early = early_answer(client.socket());
                return false;
            }
            constexpr std::size_t piece = 1 << 16; // looks for an answer that often
            return sink.write(body->bytes.data() + offset, std::min(length, piece));
        };
        const httplib::Result result = method == "GET"      ? client.Get(at, headers)
                                       : method == "DELETE" ? client.Delete(at, headers)
                                                            : client.Post(at, headers, body->bytes.size(), send, body->media_type);
        const bool timed_out = watch.end();
        if (result) return *result;
        if (early) return *early;
        explain(result.error(), timed_out, path);
    }

private:
    [[noreturn]] void explain(httplib::Error error, bool timed_out, const std::string& path) const
    {
        const std::string at = url_.origin + url_.path + path;
        if (error == httplib::Error::Connection || error == httplib::Error::ConnectionTimeout)
            throw ConnectionFailed(Problem{0, at + ": nobody answers there", timed_out ? "timeout" : "connect", {}, {}});
        if (timed_out)
            throw DeadlineExceeded(
                Problem{0,
                        at + ": no whole answer within " + std::to_string(options_.timeout.count()) + " ms, the client's timeout",
                        "timeout",
                        {},
                        {}});
        throw ConnectionFailed(Problem{0, at + ": the connection broke (" + httplib::to_string(error) + ")", "broke", {}, {}});
    }

    double pause_s(int attempt) const
    {
        static thread_local std::minstd_rand random{std::random_device{}()};
        const double first_s = std::chrono::duration<double>(options_.backoff).count();
        return std::min(max_backoff_s, std::ldexp(first_s, std::min(attempt, 30))) * std::uniform_real_distribution(0.5, 1.0)(random);
    }

    Url url_;
    Options options_;
};

} // namespace detail
} // namespace penumbra::client
