// Everything that can be set, declared once: flags, environment, --help, the start-up block and docs/limits.md come from one table.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace penumbra::server {

struct Options {
    std::string host = "127.0.0.1";
    std::int64_t port = 8080;
    std::string device;
    std::string token;
    bool allow_meshes = false;
    std::string names = {};   // further names of this service, for Host
    std::string origins = {}; // further origins whose pages may use it

    // Limits of one request.
    std::int64_t body_bytes = std::int64_t{64} << 20;
    std::int64_t scene_bytes = std::int64_t{1} << 20;
    std::int64_t parts = 16;
    std::int64_t image_samples = std::int64_t{1} << 24;
    std::int64_t receivers = std::int64_t{1} << 22;
    std::int64_t pairs = std::int64_t{1} << 40;
    std::int64_t rays = std::int64_t{1} << 34;
    std::int64_t deadline_s = 30;
    std::int64_t header_s = 5;
    std::int64_t header_bytes = 16384;
    std::int64_t transfer_bytes_s = 16384;

    // Limits of the service.
    std::int64_t memory = 0;
    std::int64_t slots = 2;
    std::int64_t spares = 1;
    std::int64_t queue = 16;
    std::int64_t io_threads = 32;
    std::int64_t connections = 512;
    std::int64_t answer_bytes = std::int64_t{256} << 20;
    std::int64_t drain_s = 0;
    std::int64_t scenes = 64;
    std::int64_t scenes_bytes = std::int64_t{1} << 30;
    std::int64_t scenes_s = 600;
};

struct WholeNumbers {
    std::int64_t low, high;
};

// One option. Its environment variable is PENUMBRA_SERVER_ and its name in capitals.
struct OptionRow {
    std::string_view name, unit, meaning;
    WholeNumbers range{0, 0}; // of a number
    std::variant<std::int64_t Options::*, bool Options::*, std::string Options::*> member;
    bool secret = false; // its value is never shown
};

std::span<const OptionRow> option_table();
std::string flag_of(const OptionRow& row);        // "--body-bytes"
std::string environment_of(const OptionRow& row); // "PENUMBRA_SERVER_BODY_BYTES"

// What the environment says, then what the arguments say on top. Throws usage naming the flag or variable and what it takes.
using Environment = std::function<const char*(const char*)>; // as std::getenv
Options options_from(const std::vector<std::string>& arguments, const Environment& environment);

// Arguments that say the same, without the token: for processes of the service's own.
std::vector<std::string> arguments_of(const Options& options);

// Throws usage for options that do not go together.
void check_together(const Options& options);

std::string help_text();
std::string startup_text(const Options& options); // name = value, a line each
std::string limits_markdown();                    // docs/limits.md

} // namespace penumbra::server
