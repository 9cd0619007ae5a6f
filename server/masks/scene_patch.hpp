// Changing a scene's JSON: a JSON Merge Patch (RFC 7396) of the sections that may change while objects and images stay.
#pragma once

#include <array>
#include <string_view>

#include <nlohmann/json.hpp>

namespace penumbra::server {

inline constexpr std::array<std::string_view, 5> patched_sections{"light", "lights", "receivers", "technique", "output"};

// `scene` with `patch` merged in. A light, camera or technique whose `kind` differs from the one before replaces it instead: keys of one
// kind mean nothing to another. Lists, `lights` among them, are replaced whole. Throws invalid_input for other sections than light, lights,
// receivers, technique and output, naming them.
nlohmann::json patched(const nlohmann::json& scene, const nlohmann::json& patch);

// Whether one of the objects hangs on the light's own view (its camera is of kind light).
bool objects_follow_light(const nlohmann::json& scene);

} // namespace penumbra::server
