#pragma once

#include <span>
#include <string_view>

namespace penumbra::server {

// A file of clients/web, embedded by the build.
struct Asset {
    std::string_view path; // "/" for index.html, "/page/NAME" for the others
    std::string_view media_type;
    std::string_view bytes;
};

// The page that `GET /` serves and all that it loads; it needs nothing from elsewhere.
std::span<const Asset> page_assets();

} // namespace penumbra::server
