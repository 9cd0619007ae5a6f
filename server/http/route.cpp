#include "http/route.hpp"

#include <algorithm>
#include <array>

namespace penumbra::server {
namespace {

using enum Answer;

constexpr std::array list{
    Route{"GET", "/", "A page to try it.", page, true},
    Route{"POST", "/v1/masks", "Compute the mask of a scene.", mask},
    Route{"POST", "/v1/scenes", "Keep a scene, to compute masks of it without sending it again.", scene},
    Route{"GET", "/v1/scenes/{id}", "Whether a scene is still kept.", scene},
    Route{"DELETE", "/v1/scenes/{id}", "Let a kept scene go.", nothing},
    Route{"POST", "/v1/scenes/{id}/masks", "Compute a mask of a kept scene, with lights, receivers, technique or output changed.", mask},
    Route{"POST", "/v1/depth", "The depth of a scene's receivers as the service reads it, at most `side` pixels wide and high.", depth},
    Route{"GET", "/v1/techniques", "Each technique with its keys as JSON Schema, its lights and what it needs.", json},
    Route{"GET", "/v1/devices", "The OpenCL devices of the machine; `selected` is the one that computes.", json},
    Route{"GET", "/healthz", "The process answers.", text, true},
    Route{"GET", "/readyz", "A known mask was computed and compared, every technique is warm, and the service is not about to end.", text,
          true},
    Route{"GET", "/metrics", "Prometheus metrics.", text},
    Route{"GET", "/openapi.json", "This description.", json},
};

constexpr std::string_view hole = "{id}";

} // namespace

std::span<const Route> routes() { return list; }

bool is_id(std::string_view text)
{
    return text.size() == 64 && std::ranges::all_of(text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool fits(const Route& route, std::string_view path)
{
    const std::size_t at = route.path.find(hole);
    if (at == std::string_view::npos) return path == route.path;
    const std::string_view before = route.path.substr(0, at), after = route.path.substr(at + hole.size());
    return path.starts_with(before) && path.ends_with(after) && path.size() >= before.size() + after.size() &&
           is_id(path.substr(before.size(), path.size() - before.size() - after.size()));
}

const Route* route_at(std::string_view path, std::string_view method)
{
    if (method == "HEAD") method = "GET";
    const Route* found = nullptr;
    for (const Route& route : list) {
        if (!fits(route, path)) continue;
        if (route.method == method) return &route;
        if (!found) found = &route;
    }
    return found;
}

std::string allowed_methods(std::string_view path)
{
    std::string text;
    for (const Route& route : list) {
        if (!fits(route, path)) continue;
        text += (text.empty() ? "" : ", ") + std::string(route.method);
        if (route.method == "GET") text += ", HEAD";
    }
    return text;
}

std::string literal_pattern(std::string_view path)
{
    std::string pattern;
    for (const char c : path) {
        if (std::string_view(".^$|()[]{}*+?\\").find(c) != std::string_view::npos) pattern += '\\';
        pattern += c;
    }
    return pattern;
}

} // namespace penumbra::server
