#include "io/scene_tables.hpp"

#include <algorithm>
#include <vector>

#include <penumbra/error.hpp>

#include "io/scene_description.hpp"

namespace penumbra {

using namespace scene_file;

namespace {

// The section of docs/scene_file.md that describes it.
std::string link_to(std::string_view name)
{
    const std::string_view heading = name == "listed_light"                                                   ? "lights"
                                     : name == "object" || name == "quad"                                     ? "objects"
                                     : name == "occluders" || name == "receivers" || name == "occluder_depth" ? "occluders-and-receivers"
                                     : name == "anchor"                                                       ? "encoding"
                                                                                                              : name;
    const std::string text = name == "listed_light"     ? "lights"
                             : name == "object"         ? "objects"
                             : name == "occluder_depth" ? "images"
                             : name == "anchor"         ? "anchors"
                                                        : std::string(name);
    return "[" + text + "](#" + std::string(heading) + ")";
}

std::string count_words(std::size_t low, std::size_t high, const std::string& things)
{
    return high == any_number ? "list of " + things : "list of " + std::to_string(low) + " to " + std::to_string(high) + " " + things;
}

// What a value may be, for people.
struct TypeWords {
    std::string operator()(const Constant& constant) const
    {
        const auto* number = std::get_if<int>(&constant.value);
        return number ? std::to_string(*number) : std::string(std::get<std::string_view>(constant.value));
    }
    std::string operator()(const Number& range) const { return expected(range).substr(std::string_view("a ").size()); }
    std::string operator()(const OneOfIntegers& integers) const { return expected(integers); }
    std::string operator()(const Boolean&) const { return "true or false"; }
    std::string operator()(const Text&) const { return "string"; }
    std::string operator()(const File&) const { return "file"; }
    std::string operator()(const Files& files) const
    {
        return (files.or_one ? "file, or " : "") + count_words(files.low, files.high, "files");
    }
    std::string operator()(const FileTable&) const { return "object of files"; }
    std::string operator()(const Numbers& numbers) const
    {
        return numbers.count == 3 ? "`[x, y, z]`" : numbers.count == 2 ? "`[x, y]`" : std::to_string(numbers.count) + " numbers";
    }
    std::string operator()(const LengthOrAuto&) const { return "above 0, or `\"auto\"`"; }
    std::string operator()(const NameOrNumber&) const { return "string, or integer from 0"; }
    std::string operator()(const Pair&) const { return "`[x, y]` or one number, above 0"; }
    std::string operator()(const Size& size) const
    {
        return "two integers, " + std::to_string(size.low) + " to " + std::to_string(size.high);
    }
    std::string operator()(const One& one) const { return link_to(one.object().name); }
    std::string operator()(const List& list) const { return count_words(list.low, list.high, link_to(list.object().name)); }
    std::string operator()(const TechniqueKeys&) const { return link_to("technique"); }
};

std::string type_words(const Key& key)
{
    return std::visit(TypeWords{}, key.type) + (key.unit.empty() ? "" : " (" + std::string(key.unit) + ")");
}

std::string default_words(const Key& key)
{
    if (key.required) return "needed";
    return key.fallback.empty() ? std::string(key.otherwise) : "`" + std::string(key.fallback) + "`";
}

// A row of the table without the forms that have it.
std::string row_of(const Key& key)
{
    return "`" + std::string(key.name) + "` | " + type_words(key) + " | " + default_words(key) + " | " + std::string(key.meaning) + " |";
}

struct Row {
    std::string text;
    std::vector<std::string_view> forms;
};

// "all", "all but rectangle", or those that there are.
std::string forms_words(const std::vector<std::string_view>& have, const scene_file::Object& object)
{
    if (have.size() == object.forms.size()) return "all";
    std::string list, others;
    for (const std::string_view name : have) list += (list.empty() ? "`" : "; `") + std::string(name) + "`";
    if (have.size() + 1 != object.forms.size() || object.forms.size() < 3) return list;
    for (const Form& form : object.forms)
        if (std::ranges::find(have, form.name) == have.end()) others = form.name;
    return "all but `" + others + "`";
}

bool is_key_of(const scene_file::Object& object, const Key& key)
{
    return std::ranges::any_of(object.forms, [&](const Form& form) {
        return std::ranges::any_of(form.keys, [&](const Key& own) { return own.name == key.name; });
    });
}

// Keys that several forms share stand once, where the first of them has it; the kinds stand in the first column.
std::string keys_table(const scene_file::Object& object)
{
    std::vector<Row> rows;
    for (const Form& form : object.forms)
        for (const Key& key : form.keys) {
            if (key.name == "kind" || (&object == &listed_light() && is_key_of(light(), key))) continue;
            const std::string text = row_of(key);
            const auto found = std::ranges::find(rows, text, &Row::text);
            if (found == rows.end())
                rows.push_back({text, {form.name}});
            else
                found->forms.push_back(form.name);
        }
    const bool several = std::ranges::any_of(rows, [&](const Row& row) { return row.forms.size() < object.forms.size(); });
    std::string table = several ? "| kind | key | type | default | meaning |\n| --- | --- | --- | --- | --- |\n"
                                : "| key | type | default | meaning |\n| --- | --- | --- | --- |\n";
    for (const Row& row : rows)
        table += (several ? "| " + forms_words(row.forms, object) : "") + (several ? " | " : "| ") + row.text + "\n";
    return table;
}

std::string kinds_table(const scene_file::Object& object)
{
    std::string table = "| kind | meaning |\n| --- | --- |\n";
    for (const Form& form : object.forms) table += "| `" + std::string(form.name) + "` | " + std::string(form.meaning) + " |\n";
    return table;
}

const scene_file::Object& object_named(std::string_view name)
{
    for (const scene_file::Object* object : objects())
        if (object->name == name) return *object;
    throw Error(ErrorCode::usage, "the scene file has no object " + std::string(name));
}

} // namespace

std::string with_tables(std::string_view document)
{
    constexpr std::string_view begin = "<!-- ", close = " -->\n", end = "<!-- end -->\n";
    std::string result;
    while (true) {
        const std::size_t at = std::min(document.find("<!-- keys of "), document.find("<!-- kinds of "));
        if (at == std::string_view::npos) return result + std::string(document);
        const std::size_t body = document.find(close, at);
        const std::size_t behind = document.find(end, at);
        if (body == std::string_view::npos || behind == std::string_view::npos)
            throw Error(ErrorCode::usage, "a block of tables has no end", "expected the line <!-- end -->");
        const std::string_view head = document.substr(at + begin.size(), body - at - begin.size());
        const scene_file::Object& object = object_named(head.substr(head.find(" of ") + 4));
        result +=
            std::string(document.substr(0, body + close.size())) + (head.starts_with("keys") ? keys_table(object) : kinds_table(object));
        result += end;
        document.remove_prefix(behind + end.size());
    }
}

namespace {

std::string listed(std::string_view before, std::string_view after)
{
    std::string list;
    for (const std::string& place : file_places()) list += std::string(before) + "\"" + place + "\"" + std::string(after);
    return list;
}

} // namespace

std::string cpp_file_places()
{
    return "// Made by `penumbra_describe_scene --cpp` from the description of the scene file.\n"
           "#pragma once\n\n#include <array>\n#include <string_view>\n\nnamespace penumbra::client::detail {\n\n"
           "// Where a scene names files; [] is each element of a list, {} each member of a table.\n"
           "inline constexpr std::array<std::string_view, " +
           std::to_string(file_places().size()) + "> file_places{\n" + listed("    ", ",\n") +
           "};\n\n} // namespace penumbra::client::detail\n";
}

std::string python_file_places()
{
    return "\"\"\"Made by `penumbra_describe_scene --python` from the description of the scene file.\"\"\"\n\n"
           "# Where a scene names files; [] is each element of a list, {} each member of a table.\nFILE_PLACES = (\n" +
           listed("    ", ",\n") + ")\n";
}

} // namespace penumbra
