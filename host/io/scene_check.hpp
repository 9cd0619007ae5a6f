// Objects of a scene file, checked against their description.
#pragma once

#include "io/json_value.hpp"
#include "io/scene_description.hpp"

namespace penumbra {

// The object, of which every key is in the form, no needed one is missing and every value is of its type and in its range. Throws
// invalid_input naming the path. Objects inside of it are left to those who read them.
JsonObject checked(const JsonValue& value, const scene_file::Form& form);

// In its only form.
JsonObject checked(const JsonValue& value, const scene_file::Object& object);

// The only one there is of the form's keys that exclude each other. Throws when there are several, or, for the first, that it is missing.
JsonValue checked_choice(const JsonObject& section, const scene_file::Form& form);

// Which of the object's kinds it is, by its place in kinds_of.
std::size_t kind_index(const JsonValue& value, const scene_file::Object& object);

// Whether a file of one of these names is named in `value`, which stands at that place of the scene ("light", "lights", "lights[]").
bool names_file(const nlohmann::json& value, std::string_view at, std::span<const std::string_view> names);

} // namespace penumbra
