// Bytes that two processes see: a file in memory (memfd_create(2)), whose descriptor travels over a channel.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "process/descriptor.hpp"
#include "process/room.hpp"

namespace penumbra::server {

class SharedBytes {
public:
    SharedBytes() = default;
    // Room for so many bytes, zeros that take no memory until they are written. Throws std::bad_alloc.
    explicit SharedBytes(std::size_t size, Room::Hold hold = {}); // which goes with them
    // What another process made, to read. Throws std::bad_alloc where it cannot be mapped.
    explicit SharedBytes(Descriptor file);
    SharedBytes(SharedBytes&& other) noexcept;
    SharedBytes& operator=(SharedBytes&& other) noexcept;
    ~SharedBytes();

    char* data() { return bytes_; }
    std::size_t size() const { return size_; }
    operator std::string_view() const { return {bytes_, size_}; }
    int descriptor() const { return file_.get(); }

private:
    Room::Hold hold_;
    Descriptor file_;
    char* bytes_ = nullptr;
    std::size_t size_ = 0;
};

// What goes to another process, one after another: the file stays, and with it its memory, which the system need not find and clear for each.
// The other side has copied one before the next is put.
class Outbox {
public:
    // Gives the file that holds the bytes at its begin, for as long as this lives or until the next ones. Throws std::bad_alloc.
    int put(std::string_view bytes);

private:
    Descriptor file_;
    std::size_t size_ = 0; // that it has had
};

// The first `size` bytes of what another process made, or what there is of them. Reads, and does not map: a file that shrinks meanwhile ends the
// copy, not this process.
std::string copy_of(const Descriptor& file, std::size_t size);

} // namespace penumbra::server
