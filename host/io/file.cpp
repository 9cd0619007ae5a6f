// Whole files, in and out.
#include "io/image_io.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

// The largest image that is read is 4 GiB of float32 samples; its file may have other channels beside.
constexpr std::uint64_t max_file_bytes = std::uint64_t{8} << 30;

std::string system_text(int number) { return std::generic_category().message(number); }

struct Descriptor {
    int fd = -1;
    explicit Descriptor(int number) : fd(number) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { close(); }

    // Closing may report that earlier writes failed.
    bool close()
    {
        const int old = fd;
        fd = -1;
        return old < 0 || ::close(old) == 0;
    }
};

bool write_all(int fd, std::span<const std::byte> bytes)
{
    while (!bytes.empty()) {
        const ssize_t written = ::write(fd, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return true;
}

[[noreturn]] void fail_output(const std::string& path, int number)
{
    if (number == ENOENT || number == ENOTDIR) {
        const std::string folder = std::filesystem::path(path).parent_path().string();
        throw Error(ErrorCode::output, path + ": the folder " + (folder.empty() ? "." : folder) + " is not there", "make it first");
    }
    throw Error(ErrorCode::output, path + ": cannot be written: " + system_text(number));
}

// A new, empty file beside `path`; sets `name`. O_EXCL keeps writers in other threads and processes apart.
int create_beside(const std::string& path, std::string& name)
{
    for (int attempt = 0;; ++attempt) {
        name = path + ".part" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
        const int fd = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd >= 0 || errno != EEXIST || attempt == 1000) return fd;
    }
}

void write_through(const std::string& path, std::span<const std::byte> bytes)
{
    Descriptor out(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (out.fd < 0 || !write_all(out.fd, bytes) || !out.close()) fail_output(path, errno);
}

} // namespace

std::vector<std::byte> read_file(const std::string& path, std::string_view where)
{
    // A file that goes by its path is the place of the error; one that a scene names is told by that name.
    const std::string subject(where.empty() ? std::string_view(path) : where);
    const auto failure = [&](ErrorCode code, const std::string& what) {
        return subject == path ? Error(code, what).within(path) : Error(code, subject + ": " + what, "looked for " + path);
    };
    const Descriptor in(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (in.fd < 0 && (errno == ENOENT || errno == ENOTDIR)) throw failure(ErrorCode::not_found, "no such file");
    if (in.fd < 0) throw failure(ErrorCode::not_found, "cannot be opened: " + system_text(errno));

    struct stat status = {};
    if (::fstat(in.fd, &status) != 0) throw failure(ErrorCode::not_found, "cannot be read: " + system_text(errno));
    if (S_ISDIR(status.st_mode)) throw failure(ErrorCode::not_found, "is a folder, expected a file");

    // The size is only a guess: pipes have none, and a file may change under us.
    std::vector<std::byte> bytes;
    std::size_t filled = 0;
    bytes.resize(static_cast<std::size_t>(std::min<std::uint64_t>(static_cast<std::uint64_t>(status.st_size), max_file_bytes)) + 1);
    for (;;) {
        if (filled == bytes.size()) bytes.resize(bytes.size() + std::max<std::size_t>(bytes.size() / 2, 65536));
        const ssize_t count = ::read(in.fd, bytes.data() + filled, bytes.size() - filled);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw failure(ErrorCode::not_found, "cannot be read: " + system_text(errno));
        if (count == 0) break;
        filled += static_cast<std::size_t>(count);
        if (filled > max_file_bytes)
            throw failure(ErrorCode::too_large, "is over the limit of " + std::to_string(max_file_bytes) + " bytes");
    }
    bytes.resize(filled);
    return bytes;
}

void write_file(const std::string& path, std::span<const std::byte> bytes)
{
    namespace fs = std::filesystem;
    std::error_code ignored;

    // A device or a pipe is written to, never replaced; a link keeps leading to its file.
    const fs::file_status status = fs::status(path, ignored);
    if (fs::is_directory(status)) throw Error(ErrorCode::output, path + ": is a folder, expected a file name");
    if (fs::exists(status) && !fs::is_regular_file(status)) return write_through(path, bytes);
    const std::string target =
        fs::exists(status) && fs::is_symlink(fs::symlink_status(path, ignored)) ? fs::canonical(path, ignored).string() : path;

    std::string temporary;
    Descriptor out(create_beside(target, temporary));
    if (out.fd < 0) fail_output(path, errno);
    if (!write_all(out.fd, bytes) || !out.close() || ::rename(temporary.c_str(), target.c_str()) != 0) {
        const int number = errno;
        ::unlink(temporary.c_str());
        fail_output(path, number);
    }
}

} // namespace penumbra
