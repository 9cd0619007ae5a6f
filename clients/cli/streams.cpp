#include "streams.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <sys/ioctl.h>
#include <unistd.h>

#include <penumbra/error.hpp>

namespace penumbra::cli {
namespace {

std::string one_line(std::string_view text)
{
    std::string line(text);
    for (char& c : line)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    return line;
}

void write_error_line(const std::string& line)
{
    draw_line("");
    // One call, so that lines of several processes do not mix.
    std::fwrite((line + "\n").data(), 1, line.size() + 1, stderr);
    std::fflush(stderr);
}

} // namespace

void print(std::string_view text)
{
    errno = 0;
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
        throw Error(ErrorCode::output, std::string("standard output cannot be written: ") + std::strerror(errno));
}

void print_error(std::string_view what) { write_error_line("penumbra: " + one_line(what)); }

void print_warnings(const std::vector<std::string>& warnings, std::string_view where)
{
    const std::string prefix = where.empty() ? std::string() : std::string(where) + ": ";
    for (const std::string& warning : warnings) write_error_line("penumbra: warning: " + one_line(prefix + warning));
}

bool on_terminal()
{
    static const bool capable = [] {
        const char* terminal = std::getenv("TERM");
        return isatty(STDERR_FILENO) != 0 && terminal && std::string_view(terminal) != "dumb";
    }();
    return capable;
}

std::size_t terminal_columns()
{
    winsize size{};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

void draw_line(std::string_view text)
{
    if (!on_terminal()) return;
    // Back to the first column and erase to the right; one column less than there is, so that no terminal wraps.
    const std::string line = "\r\x1b[K" + one_line(text.substr(0, terminal_columns() - 1));
    std::fwrite(line.data(), 1, line.size(), stderr);
    std::fflush(stderr);
}

} // namespace penumbra::cli
