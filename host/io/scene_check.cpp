#include "io/scene_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace penumbra {

using namespace scene_file;

namespace {

std::string up_to(double high)
{
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "up to %g", high);
    return text.data();
}

// Throws for a value that is not what it may be.
struct Check {
    const JsonValue& value;

    void operator()(const Constant&) const {} // kinds decide the form, and the version comes before everything
    void operator()(const Number& range) const
    {
        if (!value.json().is_number()) throw value.expected(expected(range));
        const double number = value.number();
        const bool low = range.above_low ? number > range.low : number >= range.low;
        const bool high = range.below_high ? number < range.high : number <= range.high;
        if (!low || !high) throw value.expected(std::abs(number) > largest ? "a number " + up_to(largest) + " in size" : expected(range));
    }
    void operator()(const OneOfIntegers& integers) const
    {
        const auto is_value = [this](int allowed) { return value.json() == allowed; };
        if (!value.json().is_number_integer() || std::ranges::none_of(integers.values, is_value)) throw value.expected(expected(integers));
    }
    void operator()(const Boolean&) const { value.flag(); }
    void operator()(const Text&) const { value.text(); } // patterns are for those who know what to say about them
    void operator()(const File&) const { value.text(); }
    void operator()(const Files& files) const
    {
        if (files.or_one && !value.json().is_array()) {
            value.text();
            return;
        }
        const std::vector<JsonValue> elements = value.elements();
        if (elements.size() < files.low || elements.size() > files.high)
            throw value.error("has " + std::to_string(elements.size()) + " images",
                              "expected " + std::to_string(files.low) + " to " + std::to_string(files.high));
        for (const JsonValue& element : elements) element.text();
    }
    void operator()(const FileTable&) const
    {
        for (const auto& [name, file] : JsonObject(value).members()) file.text();
    }
    void operator()(const Numbers& numbers) const
    {
        for (const double number : value.numbers(numbers.count))
            if (std::abs(number) > largest) throw value.expected("numbers " + up_to(largest) + " in size");
    }
    void operator()(const LengthOrAuto&) const
    {
        if (value.json().is_string() && value.json() == "auto") return;
        if (!value.json().is_number() || !(value.number() > 0) || value.number() > largest) throw value.expected("a number above 0, or \"auto\"");
    }
    void operator()(const NameOrNumber&) const
    {
        if (value.json().is_string())
            value.text();
        else
            value.integer(0, std::numeric_limits<int>::max());
    }
    void operator()(const Pair& pair) const
    {
        const Vec2 both = value.positive_pair();
        if (!(std::max(both.x, both.y) <= pair.high)) throw value.expected("numbers " + up_to(pair.high));
    }
    void operator()(const Size& size) const
    {
        if (!value.json().is_array() || value.json().size() != 2) throw value.expected("[width, height]");
        for (const JsonValue& side : value.elements()) side.integer(size.low, size.high);
    }
    void operator()(const One&) const {}
    void operator()(const List&) const {}
    void operator()(const TechniqueKeys&) const {}
};

// The same, for the rest of a place of files.
bool named_at(const nlohmann::json& value, std::string_view place, std::span<const std::string_view> names)
{
    if (place.starts_with('.')) place.remove_prefix(1);
    if (place.empty()) return value.is_string() && std::ranges::find(names, value.get_ref<const std::string&>()) != names.end();
    if (place.starts_with("[]"))
        return value.is_array() &&
               std::ranges::any_of(value, [&](const nlohmann::json& element) { return named_at(element, place.substr(2), names); });
    if (place == "{}")
        return value.is_object() && std::ranges::any_of(value, [&](const nlohmann::json& member) { return named_at(member, {}, names); });
    const std::size_t end = std::min(place.find_first_of(".[{"), place.size());
    const auto member = value.is_object() ? value.find(place.substr(0, end)) : value.end();
    return member != value.end() && named_at(*member, place.substr(end), names);
}

} // namespace

JsonObject checked(const JsonValue& value, const Form& form)
{
    JsonObject section(value);
    std::vector<std::string_view> known;
    known.reserve(form.keys.size());
    for (const Key& key : form.keys) known.push_back(key.name);
    section.allow_only(known, form.of);
    for (const Key& key : form.keys) {
        if (key.required) section.need(key.name);
        if (const auto member = section.find(key.name)) std::visit(Check{*member}, key.type);
    }
    return section;
}

JsonValue checked_choice(const JsonObject& section, const Form& form)
{
    std::optional<JsonValue> found;
    for (const std::string_view key : form.exactly_one) {
        const auto member = section.find(key);
        if (member && found) throw member->error("stands beside " + found->key().substr(found->key().rfind('.') + 1), "expected one of the two");
        if (member) found = member;
    }
    return found ? *found : section.need(form.exactly_one.front());
}

JsonObject checked(const JsonValue& value, const scene_file::Object& object) { return checked(value, object.forms.front()); }

std::size_t kind_index(const JsonValue& value, const scene_file::Object& object)
{
    return JsonObject(value).need("kind").choice(kinds_of(object));
}

bool names_file(const nlohmann::json& value, std::string_view at, std::span<const std::string_view> names)
{
    return std::ranges::any_of(file_places(), [&](std::string_view place) {
        if (!place.starts_with(at)) return false;
        place.remove_prefix(at.size());
        return (place.empty() || std::string_view(".[{").find(place.front()) != std::string_view::npos) && named_at(value, place, names);
    });
}

} // namespace penumbra
