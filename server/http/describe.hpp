// What the service says about itself, as JSON.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <penumbra/engine.hpp>

#include "process/options.hpp"

namespace penumbra::server {

std::string techniques_json();
std::string devices_json(const std::vector<DeviceInfo>& devices, int selected);
std::string openapi_json(const Options& options);

} // namespace penumbra::server
