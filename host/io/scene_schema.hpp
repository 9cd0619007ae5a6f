// The scene file's description as JSON Schema (draft 2020-12), for editors and for OpenAPI.
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace penumbra {

// A schema for every object of the scene file by its name there ("Scene", "Light", "Technique"), which refer to each other by `prefix` and
// that name.
nlohmann::ordered_json scene_definitions(std::string_view prefix);

// scene.schema.json.
std::string scene_schema_json();

} // namespace penumbra
