// A worker: a process that decodes, computes and encodes one request after another, and keeps what was prepared of scenes.
#pragma once

#include "process/channel.hpp"
#include "process/options.hpp"

namespace penumbra::server {

// Says its greeting, then answers calls until the other side is gone. `temporary`: a folder for its files, empty for none. Gives the
// process's exit code.
int work(const Options& options, const std::string& temporary, Channel channel);

} // namespace penumbra::server
