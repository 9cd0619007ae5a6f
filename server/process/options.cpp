#include "process/options.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>

#include <penumbra/error.hpp>

namespace penumbra::server {
namespace {

constexpr std::int64_t kilo = 1024, mega = kilo * kilo, giga = kilo * mega;

const std::array rows{
    OptionRow{"host", "", "address to listen on; anything but loopback belongs behind a proxy", {}, &Options::host},
    OptionRow{"port", "", "port to listen on; 0: a free one, named in the start-up block", {0, 65535}, &Options::port},
    OptionRow{"device", "", "index or a part of a device's name; empty: PENUMBRA_DEVICE, else the first device", {}, &Options::device},
    OptionRow{"token",
              "",
              "what callers send as `Authorization: Bearer TOKEN`, 16 to 256 visible ASCII characters; empty: no token is asked for. "
              "Better set by the environment: flags are seen by every user of the machine",
              {},
              &Options::token,
              true},
    OptionRow{"allow-meshes",
              "",
              "take meshes as parts; they go through a private temporary file to a parser of many formats",
              {},
              &Options::allow_meshes},
    OptionRow{"names",
              "",
              "names that requests may call this host by, separated by commas, beside localhost and IP addresses",
              {},
              &Options::names},
    OptionRow{"origins",
              "",
              "origins (such as https://tools.example) whose pages may use the service beside its own, separated by commas",
              {},
              &Options::origins},
    OptionRow{"body-bytes", "bytes", "largest request body", {kilo, 4 * giga}, &Options::body_bytes},
    OptionRow{"scene-bytes", "bytes", "largest scene JSON", {64, 64 * mega}, &Options::scene_bytes},
    OptionRow{"parts", "parts", "most parts of a request, and most images and meshes that its scene names", {1, 1024}, &Options::parts},
    OptionRow{"image-samples",
              "samples",
              "largest image, width x height x channels, that is decoded; and largest occluder map that is rendered",
              {1, giga},
              &Options::image_samples},
    OptionRow{"receivers", "pixels", "largest mask, width x height", {1, giga}, &Options::receivers},
    OptionRow{"pairs",
              "pairs",
              "most pairs that a mask may take, of occluder texel, silhouette edge or slice and receiver (smoothie: of edge and texel), as a "
              "sample tells when the light is prepared",
              {1, std::int64_t{1} << 60},
              &Options::pairs},
    OptionRow{
        "rays",
        "rays",
        "most rays of ray_traced and depth_trace: samples x receivers; for a bound 16 times as many with depth_trace, twice as many with "
        "ray_traced",
        {1, std::int64_t{1} << 60},
        &Options::rays},
    OptionRow{"deadline-s",
              "seconds",
              "longest time from connection to result; work that is under way then is stopped",
              {1, 3600},
              &Options::deadline_s},
    OptionRow{"header-s", "seconds", "longest time for a request's headers", {1, 60}, &Options::header_s},
    OptionRow{"header-bytes", "bytes", "most bytes of a request's line and headers together", {kilo, 64 * kilo}, &Options::header_bytes},
    OptionRow{"transfer-bytes-s",
              "bytes a second",
              "slowest body or answer, on average, that is waited for after its first 5 seconds",
              {1, giga},
              &Options::transfer_bytes_s},
    OptionRow{"memory",
              "bytes",
              "most memory of the service; 0: what its control group allows, or the machine has. Three quarters are the workers', in even "
              "shares",
              {0, std::int64_t{1} << 50},
              &Options::memory},
    OptionRow{"slots", "requests", "requests that are decoded, computed and encoded at the same time", {1, 256}, &Options::slots},
    OptionRow{"spares",
              "workers",
              "workers kept warm beside those of the slots: one takes the place of a worker that died, or of one that is busy for longer than a "
              "quarter of a second, which goes on at low priority. Fewer where memory is short",
              {0, 256},
              &Options::spares},
    OptionRow{
        "queue", "requests", "further requests that may be uploading or waiting; more are refused with 503", {0, 1024}, &Options::queue},
    OptionRow{"io-threads", "threads", "connections served at the same time; at least slots + queue + 4", {5, 2048}, &Options::io_threads},
    OptionRow{"connections",
              "connections",
              "most connections open at a time, those that still send their headers or take their answers included; further ones wait in "
              "the kernel",
              {8, 65536},
              &Options::connections},
    OptionRow{"answer-bytes",
              "bytes",
              "most memory of answers that wait for their clients; beyond, the one that waits longest is given up",
              {mega, 64 * giga},
              &Options::answer_bytes},
    OptionRow{"drain-s", "seconds", "after SIGTERM, how long requests are still taken while /readyz says 503; then what is under way has half a second, and is stopped", {0, 600}, &Options::drain_s},
    OptionRow{"scenes", "scenes", "most scenes that are kept; the longest unused goes first", {0, 65536}, &Options::scenes},
    OptionRow{"scenes-bytes",
              "bytes",
              "most memory of all kept scenes: their parts, depth, triangles, hierarchies and what is prepared on the device; each worker keeps its share",
              {0, 1024 * giga},
              &Options::scenes_bytes},
    OptionRow{"scenes-s", "seconds", "how long a kept scene stays after its last use", {1, 86400}, &Options::scenes_s},
};

std::string text_of(bool value) { return value ? "true" : "false"; }
std::string text_of(std::int64_t value) { return std::to_string(value); }
std::string text_of(const std::string& value) { return value; }

std::string value_of(const OptionRow& row, const Options& options)
{
    const std::string text = std::visit([&](auto member) { return text_of(options.*member); }, row.member);
    return row.secret && !text.empty() ? "(set)" : text;
}

bool is_flag(const OptionRow& row) { return std::holds_alternative<bool Options::*>(row.member); }
bool is_number(const OptionRow& row) { return std::holds_alternative<std::int64_t Options::*>(row.member); }

std::string accepted(const OptionRow& row)
{
    if (is_flag(row)) return "true or false";
    if (is_number(row)) return std::to_string(row.range.low) + " to " + std::to_string(row.range.high);
    return "text";
}

// `where` is the flag or the variable.
void set(Options& options, const OptionRow& row, std::string_view text, const std::string& where)
{
    const auto wrong = [&] {
        return Error(ErrorCode::usage, where + ": \"" + (row.secret ? "..." : std::string(text)) + "\" is out of range",
                     "expected " + accepted(row) + (row.unit.empty() ? "" : " " + std::string(row.unit)));
    };
    if (const auto* number = std::get_if<std::int64_t Options::*>(&row.member)) {
        std::int64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc{} || end != text.data() + text.size() || value < row.range.low || value > row.range.high) throw wrong();
        options.*(*number) = value;
    } else if (const auto* flag = std::get_if<bool Options::*>(&row.member)) {
        if (text != "true" && text != "false") throw wrong();
        options.*(*flag) = text == "true";
    } else {
        options.*std::get<std::string Options::*>(row.member) = text;
    }
}

const OptionRow& row_of(std::string_view flag)
{
    for (const OptionRow& row : rows)
        if (flag_of(row) == flag) return row;
    throw Error(ErrorCode::usage, "unknown option \"" + std::string(flag) + "\"", "see penumbra-server --help");
}

} // namespace

std::span<const OptionRow> option_table() { return rows; }

std::string flag_of(const OptionRow& row) { return "--" + std::string(row.name); }

std::string environment_of(const OptionRow& row)
{
    std::string text = "PENUMBRA_SERVER_";
    for (const char c : row.name) text += c == '-' ? '_' : static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    return text;
}

Options options_from(const std::vector<std::string>& arguments, const Environment& environment)
{
    Options options;
    for (const OptionRow& row : rows) {
        const std::string variable = environment_of(row);
        if (const char* value = environment(variable.c_str())) set(options, row, value, variable);
    }
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::size_t equals = arguments[i].find('=');
        const std::string flag = arguments[i].substr(0, equals);
        const OptionRow& row = row_of(flag);
        if (equals != std::string::npos)
            set(options, row, std::string_view(arguments[i]).substr(equals + 1), flag);
        else if (is_flag(row))
            set(options, row, "true", flag);
        else if (i + 1 < arguments.size())
            set(options, row, arguments[++i], flag);
        else
            throw Error(ErrorCode::usage, flag + ": has no value", "expected " + accepted(row));
    }
    check_together(options);
    return options;
}

std::vector<std::string> arguments_of(const Options& options)
{
    std::vector<std::string> arguments;
    for (const OptionRow& row : rows)
        if (!row.secret) arguments.push_back(flag_of(row) + "=" + std::visit([&](auto member) { return text_of(options.*member); }, row.member));
    return arguments;
}

void check_together(const Options& options)
{
    // Threads that are left for health, metrics and refusals while every place is taken.
    const std::int64_t needed = options.slots + options.queue + 4;
    if (options.io_threads < needed)
        throw Error(ErrorCode::usage, "--io-threads: " + std::to_string(options.io_threads) + " are too few",
                    "expected at least slots + queue + 4 = " + std::to_string(needed));
    if (options.scene_bytes > options.body_bytes)
        throw Error(ErrorCode::usage, "--scene-bytes: " + std::to_string(options.scene_bytes) + " is more than a body may have",
                    "expected at most --body-bytes, " + std::to_string(options.body_bytes));
    const bool visible = std::ranges::all_of(options.token, [](char c) { return c > ' ' && c <= '~'; });
    if (!options.token.empty() && (!visible || options.token.size() < 16 || options.token.size() > 256))
        throw Error(ErrorCode::usage, "--token: cannot be used", "expected 16 to 256 visible ASCII characters");
    if (options.host.empty()) throw Error(ErrorCode::usage, "--host: is empty", "expected an address, 127.0.0.1 for this machine alone");
}

std::string help_text()
{
    const Options defaults;
    std::ostringstream out;
    out << "penumbra-server: soft-shadow masks over HTTP.\n\nUsage: penumbra-server [--OPTION VALUE] ...\n\n"
           "Options, with the default; each may be set by its environment variable instead, and the flag wins:\n";
    for (const OptionRow& row : rows) {
        const std::string value = value_of(row, defaults);
        out << "\n  " << flag_of(row) << (is_flag(row) ? "" : " " + (value.empty() ? "TEXT" : value)) << "\n      " << row.meaning
            << ".\n      ";
        if (!is_flag(row) && is_number(row)) out << accepted(row) << (row.unit.empty() ? "" : " ") << row.unit << "; ";
        out << environment_of(row) << "\n";
    }
    out << "\n  --help, --version, --limits (the table of docs/limits.md)\n\n"
           "SIGTERM and SIGINT end it: work in flight has half a second after --drain-s, and is then stopped.\n"
           "Exit codes: 0 ended as asked, 1 it could not work, 2 wrong usage.\n";
    return out.str();
}

std::string startup_text(const Options& options)
{
    std::string text;
    for (const OptionRow& row : rows) {
        const std::string value = value_of(row, options);
        text += "  " + std::string(row.name) + " = " + (value.empty() ? "(none)" : value) + (row.unit.empty() ? "" : " ") +
                std::string(row.unit) + "\n";
    }
    return text;
}

std::string limits_markdown()
{
    const Options defaults;
    std::string text = "# Options and limits of the service\n\nThis page is what `penumbra-server --limits` prints.\n\n"
                       "| option | default | takes | unit | environment | meaning |\n| --- | --- | --- | --- | --- | --- |\n";
    for (const OptionRow& row : rows)
        text += "| `" + flag_of(row) + "` | " + value_of(row, defaults) + " | " + accepted(row) + " | " + std::string(row.unit) + " | `" +
                environment_of(row) + "` | " + std::string(row.meaning) + " |\n";
    return text;
}

} // namespace penumbra::server
