// Makes SettingKeys from members of a settings struct.
#pragma once

#include <array>
#include <cctype>
#include <string>
#include <utility>

#include "technique/table.hpp"

namespace penumbra {

template <class Settings> SettingKey flag_key(std::string_view name, bool Settings::*member, std::string_view meaning)
{
    return {name,
            "",
            meaning,
            Flag{},
            [member](const Technique& t) { return SettingValue{std::get<Settings>(t).*member}; },
            [member](Technique& t, const SettingValue& v) { std::get<Settings>(t).*member = std::get<bool>(v); }};
}

template <class Settings, class Number>
SettingKey integer_key(std::string_view name, Number Settings::*member, IntegerRange range, std::string_view unit, std::string_view meaning)
{
    return {
        name,
        unit,
        meaning,
        range,
        [member](const Technique& t) { return SettingValue{static_cast<std::int64_t>(std::get<Settings>(t).*member)}; },
        [member](Technique& t, const SettingValue& v) { std::get<Settings>(t).*member = static_cast<Number>(std::get<std::int64_t>(v)); }};
}

template <class Settings>
SettingKey real_key(std::string_view name, double Settings::*member, RealRange range, std::string_view unit, std::string_view meaning)
{
    return {name,
            unit,
            meaning,
            range,
            [member](const Technique& t) { return SettingValue{std::get<Settings>(t).*member}; },
            [member](Technique& t, const SettingValue& v) { std::get<Settings>(t).*member = std::get<double>(v); }};
}

// What every technique has: the settings that the others change. technique_from takes it first, wherever it stands.
constexpr std::string_view preset_name = "preset";
template <class Settings> SettingKey preset_key(const Settings& paper)
{
    static constexpr std::array<std::string_view, 2> names{"default", "paper"};
    return {preset_name,
            "",
            "what the other keys change: default, the best that was measured, or paper, as published",
            Choices{{names.begin(), names.end()}},
            [](const Technique& t) { return SettingValue{std::string(names.at(static_cast<std::size_t>(std::get<Settings>(t).preset)))}; },
            [paper](Technique& t, const SettingValue& v) { std::get<Settings>(t) = std::get<std::string>(v) == names[1] ? paper : Settings{}; }};
}

template <class Settings> SettingKey tolerance_key()
{
    return real_key<Settings>("tolerance", &Settings::tolerance, {0, 1}, "visibility",
                              "what computing fewer receivers may add to a pixel's error: those between lie on what was computed around them; 0 computes all");
}

// The names of an enumeration's values, as users write them: in the order of the enumerators, which count from 0.
template <std::size_t count> using Names = std::array<std::string_view, count>;

template <class Settings, class Enum, std::size_t count>
SettingKey choice_key(std::string_view name, Enum Settings::*member, const Names<count>& all, std::string_view meaning)
{
    const std::vector<std::string_view> names(all.begin(), all.end());
    return {name,
            "",
            meaning,
            Choices{names},
            [member, names](const Technique& t) {
                return SettingValue{std::string(names.at(static_cast<std::size_t>(std::get<Settings>(t).*member)))};
            },
            [member, names](Technique& t, const SettingValue& v) {
                for (std::size_t i = 0; i < names.size(); ++i)
                    if (names[i] == std::get<std::string>(v)) std::get<Settings>(t).*member = static_cast<Enum>(i);
            }};
}

// A choice on its way to the kernels, by name: ("ACCUMULATOR", "ACCUMULATOR_BINARY32"), which kernels/common/choices.h defines.
template <class Enum, std::size_t count>
std::pair<std::string, std::string> choice_constant(const std::string& constant, const Names<count>& names, Enum choice)
{
    std::string value = constant + '_';
    for (const char c : names.at(static_cast<std::size_t>(choice))) value += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return {constant, value};
}

} // namespace penumbra
