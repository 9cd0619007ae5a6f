// Every route: the router, the checks and /openapi.json read this one list.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace penumbra::server {

enum class Answer { mask, scene, depth, json, text, page, nothing };

struct Route {
    std::string_view method, path, summary; // `path` may hold one segment {id}
    Answer answer;
    bool open = false; // needs no token
};
std::span<const Route> routes();

// 64 hexadecimal digits, as id_of gives them.
bool is_id(std::string_view text);

// Whether `path` is one of that route.
bool fits(const Route& route, std::string_view path);
// The route of a path and method; HEAD counts as GET. With no such method, the first route of the path; with no such path, null.
const Route* route_at(std::string_view path, std::string_view method);

// Those of a path, as the Allow header lists them.
std::string allowed_methods(std::string_view path);

// A pattern of the HTTP library (a regular expression) that only this path matches.
std::string literal_pattern(std::string_view path);

} // namespace penumbra::server
