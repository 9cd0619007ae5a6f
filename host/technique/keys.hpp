// Makes SettingKeys from members of a settings struct.
#pragma once

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

// `names` in the order of the enumerators, which count from 0.
template <class Settings, class Enum>
SettingKey choice_key(std::string_view name, Enum Settings::*member, std::vector<std::string_view> names, std::string_view meaning)
{
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

} // namespace penumbra
