#include "technique_flags.hpp"

#include <charconv>
#include <optional>
#include <sstream>

#include <penumbra/error.hpp>
#include <penumbra/technique.hpp>

#include "scene/joined.hpp"
#include "technique/table.hpp"

namespace penumbra::cli {
namespace {

template <class Number> std::optional<SettingValue> number_from(std::string_view text)
{
    Number number{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return SettingValue{number};
}

// The text as a value of the key's own type.
struct Parse {
    std::string_view text;
    std::optional<SettingValue> operator()(const Flag&) const
    {
        if (text == "true") return SettingValue{true};
        if (text == "false") return SettingValue{false};
        return std::nullopt;
    }
    std::optional<SettingValue> operator()(const IntegerRange&) const { return number_from<std::int64_t>(text); }
    std::optional<SettingValue> operator()(const RealRange&) const { return number_from<double>(text); }
    std::optional<SettingValue> operator()(const Choices&) const { return SettingValue{std::string(text)}; }
};

// What is no value of the key's type, and what belongs to no key, stays text: technique_from refuses it in the library's words.
SettingValue value_from(const TechniqueRow& row, std::string_view name, std::string_view text)
{
    for (const SettingKey& key : row.keys)
        if (key.name == name) return std::visit(Parse{text}, key.domain).value_or(SettingValue{std::string(text)});
    return SettingValue{std::string(text)};
}

void set(TechniqueRequest& request, std::string name, SettingValue value)
{
    for (auto& [known, held] : request.settings)
        if (known == name) {
            held = std::move(value);
            return;
        }
    request.settings.emplace_back(std::move(name), std::move(value));
}

std::string text_of(const SettingValue& value)
{
    std::ostringstream out;
    out << std::boolalpha;
    std::visit([&out](const auto& held) { out << held; }, value);
    return out.str();
}

struct DomainText {
    std::string operator()(const Flag&) const { return "true or false"; }
    std::string operator()(const IntegerRange& range) const { return std::to_string(range.low) + " to " + std::to_string(range.high); }
    std::string operator()(const RealRange& range) const { return text_of(range.low) + " to " + text_of(range.high); }
    std::string operator()(const Choices& choices) const { return joined(choices.names); }
};

std::string key_help(const SettingKey& key, const Technique& defaults)
{
    const std::string unit = key.unit.empty() ? "" : " " + std::string(key.unit);
    return "    " + std::string(key.name) + "=" + text_of(key.get(defaults)) + "  (" + std::visit(DomainText{}, key.domain) + unit +
           ")\n        " + std::string(key.meaning) + "\n";
}

} // namespace

void add_technique_flags(CLI::App& app, TechniqueFlags& flags)
{
    app.add_option("--technique", flags.kind, "the technique, instead of the scene's")->option_text("KIND");
    app.add_option("--set", flags.settings, "a key of the technique, instead of the scene's value; repeatable")
        ->option_text("KEY=VALUE")
        ->allow_extra_args(false);
}

void add_device_flag(CLI::App& app, std::string& selector)
{
    app.add_option("--device", selector,
                   "index or a part of a device's name, see penumbra info;\nwithout it PENUMBRA_DEVICE, else the first device")
        ->option_text("SELECTOR");
}

TechniqueRequest apply(TechniqueRequest request, const TechniqueFlags& flags)
{
    if (!flags.kind.empty() && flags.kind != request.kind) request = TechniqueRequest{.kind = flags.kind, .settings = {}};

    std::string where = flags.kind.empty() ? "" : "--technique " + flags.kind;
    try {
        technique_from(request);
        for (const std::string& setting : flags.settings) {
            where = "--set " + setting;
            const std::size_t equals = setting.find('=');
            if (equals == std::string::npos || equals == 0) throw Error(ErrorCode::usage, "expected KEY=VALUE");
            const std::string name = setting.substr(0, equals);
            set(request, name, value_from(row_of(request.kind), name, std::string_view(setting).substr(equals + 1)));
            technique_from(request);
        }
    } catch (const Error& error) {
        if (where.empty()) throw;
        throw error.within(where);
    }
    return request;
}

Engine open_engine(const std::string& selector) { return selector.empty() ? Engine() : Engine(selector); }

std::string technique_help()
{
    std::string text = "Techniques, with the keys that --set takes (KEY=default):\n";
    for (const TechniqueRow& row : technique_table()) {
        text += "\n  " + std::string(row.kind) + "\n    " + std::string(row.summary) + "\n    Lights: " + joined(row.lights) +
                (row.textured_lights ? " (textured too)" : "") + ". Needs: " + std::string(row.inputs) + "\n";
        for (const SettingKey& key : row.keys) text += key_help(key, row.defaults);
    }
    return text;
}

} // namespace penumbra::cli
