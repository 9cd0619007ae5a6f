// A kept scene as the service itself holds it: the bytes that were sent, and what the worker said of them. Workers decode it.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <utility>

#include "masks/call.hpp"
#include "process/shared_bytes.hpp"

namespace penumbra::server {

// Safe to use from several threads at once. `gone` is called when nobody needs it any more.
class KeptUpload {
public:
    KeptUpload(std::string id, SharedBytes body, std::string form, SceneFacts facts, std::function<void()> gone)
        : id_(std::move(id)), body_(std::move(body)), form_(std::move(form)), facts_(std::move(facts)), gone_(std::move(gone))
    {
    }
    ~KeptUpload() { gone_(); }
    KeptUpload(const KeptUpload&) = delete;
    KeptUpload& operator=(const KeptUpload&) = delete;

    const std::string& id() const { return id_; }
    const SharedBytes& body() const { return body_; }
    const std::string& form() const { return form_; } // the body's boundary
    std::uint64_t bytes() const { return body_.size() + facts().bytes; }
    std::uint64_t device_bytes() const { return facts().device_bytes; }
    void forget_results() const {} // the workers' stores do

    SceneFacts facts() const
    {
        const std::scoped_lock lock(mutex_);
        return facts_;
    }
    // As its use leaves it; the warnings are those of its first decoding.
    void set_size(const SceneFacts& facts)
    {
        const std::scoped_lock lock(mutex_);
        facts_.bytes = facts.bytes;
        facts_.device_bytes = facts.device_bytes;
    }

private:
    const std::string id_;
    const SharedBytes body_;
    const std::string form_;
    mutable std::mutex mutex_;
    SceneFacts facts_;
    const std::function<void()> gone_;
};

} // namespace penumbra::server
