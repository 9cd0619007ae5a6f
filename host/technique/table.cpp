#include "technique/table.hpp"

#include <cmath>
#include <optional>

#include <penumbra/error.hpp>

#include "scene/joined.hpp"
#include "technique/keys.hpp"
#include "technique/techniques.hpp"

namespace penumbra {
namespace {

std::string text_of(const SettingValue& value)
{
    struct Text {
        std::string operator()(bool v) const { return v ? "true" : "false"; }
        std::string operator()(std::int64_t v) const { return std::to_string(v); }
        std::string operator()(double v) const { return std::to_string(v); }
        std::string operator()(const std::string& v) const { return '"' + v + '"'; }
    };
    return std::visit(Text{}, value);
}

// A domain's own type for a value, or an explanation of what was expected instead.
struct Conversion {
    const SettingValue& value;
    std::string expected;

    std::optional<SettingValue> operator()(const Flag&)
    {
        expected = "true or false";
        return std::holds_alternative<bool>(value) ? std::optional(value) : std::nullopt;
    }
    std::optional<SettingValue> operator()(const IntegerRange& range)
    {
        expected = "a whole number from " + std::to_string(range.low) + " to " + std::to_string(range.high);
        const auto* number = std::get_if<std::int64_t>(&value);
        return number && *number >= range.low && *number <= range.high ? std::optional(value) : std::nullopt;
    }
    std::optional<SettingValue> operator()(const RealRange& range)
    {
        expected = "a number from " + std::to_string(range.low) + " to " + std::to_string(range.high);
        double number = std::nan("");
        if (const auto* integer = std::get_if<std::int64_t>(&value)) number = static_cast<double>(*integer);
        if (const auto* real = std::get_if<double>(&value)) number = *real;
        return number >= range.low && number <= range.high ? std::optional(SettingValue{number}) : std::nullopt;
    }
    std::optional<SettingValue> operator()(const Choices& choices)
    {
        expected = "one of " + joined(choices.names);
        const auto* text = std::get_if<std::string>(&value);
        if (text)
            for (const std::string_view choice : choices.names)
                if (choice == *text) return value;
        return std::nullopt;
    }
};

const SettingKey& key_of(const TechniqueRow& row, const std::string& name)
{
    for (const SettingKey& key : row.keys)
        if (key.name == name) return key;
    throw Error::at(ErrorCode::invalid_input, "technique." + name, "unknown key of " + std::string(row.kind),
                    "known keys: " + joined(row.keys, &SettingKey::name));
}

template <class... S> std::vector<TechniqueRow> rows_of(std::type_identity<std::variant<S...>>) { return {row(S{})...}; }

} // namespace

std::span<const TechniqueRow> technique_table()
{
    static const std::vector<TechniqueRow> table = rows_of(std::type_identity<Technique>{});
    return table;
}

const TechniqueRow& row_of(std::string_view kind)
{
    for (const TechniqueRow& row : technique_table())
        if (row.kind == kind) return row;
    throw Error::at(ErrorCode::invalid_input, "technique.kind", "unknown technique \"" + std::string(kind) + "\"",
                    "known: " + joined(technique_table(), &TechniqueRow::kind));
}

Technique technique_from(const TechniqueRequest& request)
{
    const TechniqueRow& row = row_of(request.kind);
    Technique technique = row.defaults;
    const auto take = [&](const std::string& name, const SettingValue& value) {
        const SettingKey& key = key_of(row, name);
        Conversion conversion{value, {}};
        const auto converted = std::visit([&conversion](const auto& domain) { return conversion(domain); }, key.domain);
        if (!converted)
            throw Error::at(ErrorCode::invalid_input, "technique." + name, "is " + text_of(value), "expected " + conversion.expected);
        key.set(technique, *converted);
    };
    for (const auto& [name, value] : request.settings)
        if (name == preset_name) take(name, value);
    for (const auto& [name, value] : request.settings)
        if (name != preset_name) take(name, value);
    return technique;
}

std::string kind_of(const Technique& technique)
{
    for (const TechniqueRow& row : technique_table())
        if (row.defaults.index() == technique.index()) return std::string(row.kind);
    throw Error(ErrorCode::internal, "a technique has no row in the table");
}

TechniqueRequest request_from(const Technique& technique)
{
    TechniqueRequest request{.kind = kind_of(technique), .settings = {}};
    for (const SettingKey& key : row_of(request.kind).keys) request.settings.emplace_back(key.name, key.get(technique));
    return request;
}

} // namespace penumbra
