#include "io/json_value.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

namespace penumbra {

using nlohmann::json;

namespace {

constexpr std::size_t max_depth = 32;

bool is_plain(std::string_view name)
{
    return !name.empty() && name.size() <= 64 &&
           std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
}

std::string joined(const std::string& parent, std::string_view name)
{
    const std::string own = is_plain(name) ? std::string(name) : in_quotes(name);
    return parent.empty() ? own : parent + "." + own;
}

std::string kind_of(const json& value)
{
    switch (value.type()) {
    case json::value_t::null:
        return "null";
    case json::value_t::boolean:
        return value.get<bool>() ? "true" : "false";
    case json::value_t::string:
        return "the string " + in_quotes(value.get_ref<const std::string&>());
    case json::value_t::array:
        return "an array of " + std::to_string(value.size());
    case json::value_t::object:
        return "an object";
    default:
        return value.dump();
    }
}

// "[json.exception.parse_error.101] parse error at line 2, column 3: ..." without its tag, on one line of printable characters.
std::string plain(std::string text)
{
    if (const std::size_t tag = text.find("] "); text.starts_with('[') && tag != std::string::npos) text.erase(0, tag + 2);
    std::ranges::replace_if(
        text, [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
    if (text.size() > 300) text = text.substr(0, 300) + "...";
    return text;
}

} // namespace

std::string in_quotes(std::string_view text)
{
    const bool cut = text.size() > 80;
    return json(text.substr(0, 80)).dump(-1, ' ', true, json::error_handler_t::replace) + (cut ? "..." : "");
}

namespace {

// Makes a document of what the parser meets. The parser's own way of asking about each value looks at all elements of an array for every
// object in it.
class DocumentMaker final : public json::json_sax_t {
public:
    json take() { return std::move(root_); }

    bool null() override { return add(nullptr); }
    bool boolean(bool value) override { return add(value); }
    bool number_integer(std::int64_t value) override { return add(value); }
    bool number_unsigned(std::uint64_t value) override { return add(value); }
    bool number_float(double value, const std::string&) override { return add(value); }
    bool string(std::string& value) override { return add(std::move(value)); }
    bool binary(json::binary_t& value) override { return add(std::move(value)); }
    bool start_object(std::size_t) override { return open(json::object()); }
    bool start_array(std::size_t) override { return open(json::array()); }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }

    // The parser would keep the last of equal keys without a word.
    bool key(std::string& name) override
    {
        auto& members = open_.back()->get_ref<json::object_t&>();
        const auto [place, added] = members.emplace(name, nullptr);
        if (!added) throw Error(ErrorCode::invalid_input, "the key " + in_quotes(name) + " stands twice in one object");
        member_ = &place->second;
        return true;
    }
    bool parse_error(std::size_t, const std::string&, const json::exception& error) override
    {
        throw Error(ErrorCode::invalid_input, "is not JSON: " + plain(error.what()));
    }

private:
    // Where the next value goes. Elements stay where they are while one of them is open: nothing else is added to its array.
    json& place()
    {
        if (open_.empty()) return root_;
        if (open_.back()->is_array()) return open_.back()->emplace_back();
        return *member_;
    }
    template <class Value> bool add(Value&& value)
    {
        place() = std::forward<Value>(value);
        return true;
    }
    bool open(json value)
    {
        if (open_.size() >= max_depth) throw Error(ErrorCode::invalid_input, "is nested deeper than " + std::to_string(max_depth) + " levels");
        json& at = place();
        at = std::move(value);
        open_.push_back(&at);
        return true;
    }
    bool close()
    {
        open_.pop_back();
        return true;
    }

    json root_;
    std::vector<json*> open_;
    json* member_ = nullptr; // whose key came last
};

} // namespace

json parse_json(std::string_view text)
{
    // To the parser it is the end, and what stands behind it nothing.
    if (const std::size_t at = text.find('\0'); at != std::string_view::npos)
        throw Error(ErrorCode::invalid_input, "is not JSON: byte " + std::to_string(at + 1) + " is 0");
    DocumentMaker maker;
    json::sax_parse(text, &maker);
    return maker.take();
}

Error JsonValue::error(const std::string& message, std::string hint) const
{
    return Error::at(ErrorCode::invalid_input, key_, message, std::move(hint));
}

Error JsonValue::expected(const std::string& what) const { return error("is " + kind_of(*json_) + ", expected " + what); }

double JsonValue::number() const
{
    if (!json_->is_number()) throw expected("a number");
    const double value = json_->get<double>();
    if (!std::isfinite(value)) throw expected("a finite number");
    return value;
}

double JsonValue::positive() const
{
    if (!json_->is_number() || !(number() > 0)) throw expected("a number above 0");
    return number();
}

std::int64_t JsonValue::integer(std::int64_t low, std::int64_t high) const
{
    const std::string range = "an integer from " + std::to_string(low) + " to " + std::to_string(high);
    if (!json_->is_number_integer()) throw expected(range);
    if (json_->is_number_unsigned() && json_->get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
        throw expected(range);
    const std::int64_t value = json_->get<std::int64_t>();
    if (value < low || value > high) throw expected(range);
    return value;
}

bool JsonValue::flag() const
{
    if (!json_->is_boolean()) throw expected("true or false");
    return json_->get<bool>();
}

std::string JsonValue::text() const
{
    if (!json_->is_string() || json_->get_ref<const std::string&>().empty()) throw expected("a string");
    std::string value = json_->get<std::string>();
    // File names and messages are made of these.
    if (std::ranges::any_of(value, [](unsigned char c) { return c < 0x20; })) throw expected("a string without control characters");
    return value;
}

std::vector<JsonValue> JsonValue::elements() const
{
    if (!json_->is_array()) throw expected("an array");
    std::vector<JsonValue> result;
    result.reserve(json_->size());
    for (std::size_t i = 0; i < json_->size(); ++i) result.emplace_back((*json_)[i], key_ + "[" + std::to_string(i) + "]");
    return result;
}

std::vector<double> JsonValue::numbers(std::size_t count) const
{
    if (!json_->is_array() || json_->size() != count) throw expected("an array of " + std::to_string(count) + " numbers");
    std::vector<double> result;
    for (const JsonValue& element : elements()) result.push_back(element.number());
    return result;
}

Vec3 JsonValue::vec3() const
{
    const std::vector<double> n = numbers(3);
    return {n[0], n[1], n[2]};
}

Vec2 JsonValue::positive_pair() const
{
    if (json_->is_number()) return Vec2(positive(), positive());
    if (!json_->is_array() || json_->size() != 2) throw expected("two numbers above 0, or one for both");
    const std::vector<JsonValue> pair = elements();
    return {pair[0].positive(), pair[1].positive()};
}

std::size_t JsonValue::choice(std::span<const std::string_view> names) const
{
    std::string list;
    for (const std::string_view name : names) list += (list.empty() ? "" : ", ") + std::string(name);
    if (!json_->is_string()) throw expected("one of " + list);
    const auto found = std::ranges::find(names, std::string_view(json_->get_ref<const std::string&>()));
    if (found == names.end()) throw error("is " + in_quotes(json_->get_ref<const std::string&>()) + ", which is unknown", "known: " + list);
    return static_cast<std::size_t>(found - names.begin());
}

JsonObject::JsonObject(const JsonValue& value) : value_(value)
{
    if (!value.json().is_object()) throw value.expected("an object");
}

void JsonObject::allow_only(std::span<const std::string_view> known, std::string_view of) const
{
    for (const auto& [name, member] : members()) {
        if (std::ranges::find(known, std::string_view(name)) != known.end()) continue;
        std::string list;
        for (const std::string_view each : known) list += (list.empty() ? "" : ", ") + std::string(each);
        throw member.error("is an unknown key" + (of.empty() ? std::string() : " " + std::string(of)), "known: " + list);
    }
}

std::optional<JsonValue> JsonObject::find(std::string_view key) const
{
    const auto found = value_.json().find(key);
    if (found == value_.json().end()) return {};
    return JsonValue(*found, joined(value_.key(), key));
}

JsonValue JsonObject::need(std::string_view key) const
{
    if (const auto found = find(key)) return *found;
    throw Error::at(ErrorCode::invalid_input, joined(value_.key(), key), "is missing");
}

std::vector<std::pair<std::string, JsonValue>> JsonObject::members() const
{
    std::vector<std::pair<std::string, JsonValue>> result;
    for (const auto& [name, member] : value_.json().items()) result.emplace_back(name, JsonValue(member, joined(value_.key(), name)));
    return result;
}

} // namespace penumbra
