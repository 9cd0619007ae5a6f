// A worker: a process that decodes, computes and encodes one request after another, and keeps what was prepared of scenes.
#pragma once

#include <string>

#include "process/channel.hpp"
#include "process/options.hpp"

namespace penumbra::server {

// Built kernels: of all processes, or copies of this one's in folders_in(own_cache(temporary)), where the service has made them; then those
// of all are out of reach.
enum class Kernels { shared, own };
std::string own_cache(const std::string& temporary);

// Says its greeting, then answers calls until the other side is gone. `temporary`: a folder for its files, empty for none. Gives the
// process's exit code.
int work(const Options& options, Kernels kernels, const std::string& temporary, Channel channel);

} // namespace penumbra::server
