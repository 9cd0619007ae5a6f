// JSON that knows where it stands: every complaint names the key that it is about.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/error.hpp>
#include <penumbra/scene.hpp>
#include <penumbra/scene_file.hpp>

namespace penumbra {

// Throws invalid_input, with line and column where the text is not JSON, for keys that stand twice in one object, and for nesting deeper
// than 32.
nlohmann::json parse_json(std::string_view text);

// A value and the key that leads to it ("occluders.depth.layers[2]"). Refers to the document; every accessor throws invalid_input naming
// the key.
class JsonValue {
public:
    JsonValue(const nlohmann::json& json, std::string key) : json_(&json), key_(std::move(key)) {}

    const nlohmann::json& json() const { return *json_; }
    const std::string& key() const { return key_; }

    double number() const;
    double positive() const; // more than 0
    std::int64_t integer(std::int64_t low, std::int64_t high) const;
    bool flag() const;
    std::string text() const; // not empty
    std::vector<double> numbers(std::size_t count) const;
    Vec3 vec3() const;
    Vec2 positive_pair() const; // [x, y], or one number for both; more than 0
    std::vector<JsonValue> elements() const;

    // The enumerator whose name this is, by its place in `names`.
    std::size_t choice(std::span<const std::string_view> names) const;

    Error error(const std::string& message, std::string hint = {}) const;
    Error expected(const std::string& what) const; // "<key>: is a string, expected <what>"

private:
    const nlohmann::json* json_;
    std::string key_;
};

// An object and its members.
class JsonObject {
public:
    // Throws for what is not an object.
    explicit JsonObject(const JsonValue& value);

    // Throws for a key that is not in `known`, listing those; `of` says what has them ("of a sphere").
    void allow_only(std::span<const std::string_view> known, std::string_view of = {}) const;

    const JsonValue& value() const { return value_; }
    bool has(std::string_view key) const { return value_.json().contains(key); }
    std::optional<JsonValue> find(std::string_view key) const;
    JsonValue need(std::string_view key) const; // throws when missing
    std::vector<std::pair<std::string, JsonValue>> members() const;

private:
    JsonValue value_;
};

} // namespace penumbra
