// What the service says about itself, as JSON.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/engine.hpp>

#include "options.hpp"

namespace penumbra::server {

// Every route: the router and /openapi.json both read it.
struct Route {
    std::string_view method, path, summary;
    std::string_view media_type; // of the 200 answer; empty: those of a mask
    bool open;                   // needs no token
};
std::span<const Route> routes();

std::string techniques_json();
std::string devices_json(const std::vector<DeviceInfo>& devices, int selected);
std::string openapi_json(const Options& options);

} // namespace penumbra::server
