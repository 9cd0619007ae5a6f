#include "process/shared_bytes.hpp"

#include <algorithm>
#include <cerrno>
#include <new>
#include <utility>

#include <sys/mman.h>
#include <sys/stat.h>

namespace penumbra::server {
namespace {

Descriptor new_file()
{
    Descriptor file(memfd_create("penumbra", MFD_CLOEXEC));
    if (!file) throw std::bad_alloc();
    return file;
}

std::size_t size_of(const Descriptor& file)
{
    struct stat facts {};
    return fstat(file.get(), &facts) == 0 && facts.st_size > 0 ? static_cast<std::size_t>(facts.st_size) : 0;
}

char* mapped(const Descriptor& file, std::size_t size, int protection)
{
    if (size == 0) return nullptr;
    void* const at = mmap(nullptr, size, protection, MAP_SHARED, file.get(), 0);
    if (at == MAP_FAILED) throw std::bad_alloc();
    return static_cast<char*>(at);
}

} // namespace

SharedBytes::SharedBytes(std::size_t size, Room::Hold hold) : hold_(std::move(hold)), file_(new_file()), size_(size)
{
    if (ftruncate(file_.get(), static_cast<off_t>(size)) != 0) throw std::bad_alloc();
    bytes_ = mapped(file_, size, PROT_READ | PROT_WRITE);
}

SharedBytes::SharedBytes(Descriptor file) : file_(std::move(file)), size_(size_of(file_)) { bytes_ = mapped(file_, size_, PROT_READ); }

SharedBytes::SharedBytes(SharedBytes&& other) noexcept
    : hold_(std::move(other.hold_)), file_(std::move(other.file_)), bytes_(std::exchange(other.bytes_, nullptr)),
      size_(std::exchange(other.size_, 0))
{
}

SharedBytes& SharedBytes::operator=(SharedBytes&& other) noexcept
{
    std::swap(hold_, other.hold_);
    std::swap(file_, other.file_);
    std::swap(bytes_, other.bytes_);
    std::swap(size_, other.size_);
    return *this;
}

SharedBytes::~SharedBytes()
{
    if (bytes_) munmap(bytes_, size_);
}

int Outbox::put(std::string_view bytes)
{
    constexpr std::size_t most = 4 << 20; // that is kept between two
    if (!file_ || size_ > most) file_ = new_file(), size_ = 0;
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t written = ::pwrite(file_.get(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) throw std::bad_alloc();
        done += static_cast<std::size_t>(written);
        size_ = std::max(size_, done);
    }
    return file_.get();
}

std::string copy_of(const Descriptor& file, std::size_t size)
{
    std::string bytes(std::min(size, size_of(file)), '\0');
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t got = ::pread(file.get(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        done += static_cast<std::size_t>(got);
    }
    bytes.resize(done);
    return bytes;
}

} // namespace penumbra::server
