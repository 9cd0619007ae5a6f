// JSON in time in proportion to its length, in which no key may stand twice in one object.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace penumbra::client::detail {

// Makes a document of what the parser meets. Asked for each value through a callback, the parser would look at all elements of an array for
// every object in it.
class DocumentMaker final : public nlohmann::json::json_sax_t {
    using json = nlohmann::json;

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
        const auto [place, added] = open_.back()->get_ref<json::object_t&>().emplace(name, nullptr);
        if (!added)
            throw std::invalid_argument("the key " + json(name).dump(-1, ' ', true, json::error_handler_t::replace) +
                                        " stands twice in one object");
        member_ = &place->second;
        return true;
    }
    bool parse_error(std::size_t, const std::string&, const json::exception& error) override { throw std::invalid_argument(error.what()); }

private:
    // Where the next value goes. Elements stay where they are while one of them is open: nothing else is added to its array.
    json& place()
    {
        if (open_.empty()) return root_;
        return open_.back()->is_array() ? open_.back()->emplace_back() : *member_;
    }
    template <class Value> bool add(Value&& value)
    {
        place() = std::forward<Value>(value);
        return true;
    }
    bool open(json value)
    {
        json& here = place();
        here = std::move(value);
        open_.push_back(&here);
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

// Throws std::invalid_argument for what is not JSON or has a key twice in one object.
inline nlohmann::json json_document(std::string_view text)
{
    DocumentMaker maker;
    nlohmann::json::sax_parse(text, &maker);
    return maker.take();
}

} // namespace penumbra::client::detail
