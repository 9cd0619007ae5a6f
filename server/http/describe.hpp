// What the service says about itself, as JSON: beside the library's penumbra/describe.hpp.
#pragma once

#include <string>

#include "process/options.hpp"

namespace penumbra::server {

std::string openapi_json(const Options& options);

} // namespace penumbra::server
