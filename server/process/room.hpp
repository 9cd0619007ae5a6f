// Memory that many requests share, and what of it is taken.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>

namespace penumbra::server {

// Safe to use from several threads at once.
class Room {
public:
    explicit Room(std::uint64_t bytes) : size_(bytes) {}
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;

    // So many bytes, given back when it goes. The room outlives it.
    class Hold {
    public:
        Hold() = default;
        Hold(Room& room, std::uint64_t bytes) : room_(&room), bytes_(bytes) {}
        Hold(Hold&& other) noexcept : room_(std::exchange(other.room_, nullptr)), bytes_(other.bytes_) {}
        Hold& operator=(Hold&& other) noexcept
        {
            std::swap(room_, other.room_);
            std::swap(bytes_, other.bytes_);
            return *this;
        }
        ~Hold()
        {
            if (room_) room_->give_back(bytes_);
        }

    private:
        Room* room_ = nullptr;
        std::uint64_t bytes_ = 0;
    };

    // Nothing when that many are not left.
    std::optional<Hold> take(std::uint64_t bytes)
    {
        const std::scoped_lock lock(mutex_);
        if (bytes > size_ - taken_) return {};
        taken_ += bytes;
        return Hold(*this, bytes);
    }
    std::uint64_t size() const { return size_; }
    std::uint64_t taken() const
    {
        const std::scoped_lock lock(mutex_);
        return taken_;
    }

private:
    void give_back(std::uint64_t bytes)
    {
        const std::scoped_lock lock(mutex_);
        taken_ -= bytes;
    }

    const std::uint64_t size_;
    mutable std::mutex mutex_;
    std::uint64_t taken_ = 0;
};

} // namespace penumbra::server
