// What a request brings beside its headers: its scene, images and meshes, each under a name.
#pragma once

#include <string>
#include <string_view>

namespace penumbra::server {

// `bytes` lies in the request's body.
struct Part {
    std::string name;
    std::string_view bytes;
};

} // namespace penumbra::server
