// One row a technique: its keys, the lights it takes, what it needs. Help, JSON Schema, range checks and docs are made from this.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <penumbra/technique.hpp>

namespace penumbra {

struct IntegerRange {
    std::int64_t low, high;
};
struct RealRange {
    double low, high;
};
struct Choices {
    std::vector<std::string_view> names;
};
struct Flag {};

// One setting: what it is called, what it may be, what it means. `get` and `set` reach into the settings struct of the row's technique.
struct SettingKey {
    std::string_view name, unit, meaning;
    std::variant<Flag, IntegerRange, RealRange, Choices> domain;
    std::function<SettingValue(const Technique&)> get;
    std::function<void(Technique&, const SettingValue&)> set; // the value is already of the domain's type and inside it
};

struct TechniqueRow {
    std::string_view kind, summary, source;
    std::vector<SettingKey> keys;
    std::vector<std::string_view> lights; // kinds it takes, as in light.kind
    bool textured_lights;                 // whether it takes a rectangle's emission
    std::string_view inputs;              // what it needs, in words
    bool bounds = false; // gives the lowest and the highest visibility, too
    bool on_host = false;                 // whether it shades on the host's cores
    Technique defaults;
};

std::span<const TechniqueRow> technique_table();
const TechniqueRow& row_of(std::string_view kind); // throws invalid_input naming the known kinds

} // namespace penumbra
