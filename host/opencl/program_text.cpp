#include "opencl/program_text.hpp"

#include <algorithm>
#include <set>

#include <penumbra/error.hpp>

#include "opencl/kernel_files.hpp"

namespace penumbra::opencl {
namespace {

std::optional<std::string_view> embedded(std::string_view name)
{
    const auto files = kernel_files();
    const auto at = std::find_if(files.begin(), files.end(), [name](const KernelFile& file) { return file.name == name; });
    return at == files.end() ? std::nullopt : std::optional(at->text);
}

std::string_view without_leading_blanks(std::string_view text) { return text.substr(std::min(text.find_first_not_of(" \t"), text.size())); }

// "x.clh" of a line `#include "x.clh"`; nothing for any other line.
std::optional<std::string_view> included_name(std::string_view line)
{
    line = without_leading_blanks(line);
    if (!line.starts_with('#')) return std::nullopt;
    line = without_leading_blanks(line.substr(1));
    if (!line.starts_with("include")) return std::nullopt;
    line = without_leading_blanks(line.substr(7));
    if (!line.starts_with('"')) return std::nullopt;
    return line.substr(1, line.find('"', 1) - 1);
}

bool is_pragma_once(std::string_view line)
{
    line = without_leading_blanks(line);
    return line.starts_with("#pragma once");
}

struct Expansion {
    const FileLookup& lookup;
    std::set<std::string, std::less<>> seen = {};
    std::string text = {};

    // The full name of what `from` includes as `name`.
    std::string resolve(std::string_view name, std::string_view from) const
    {
        const std::string beside = std::string(from.substr(0, from.rfind('/') + 1)).append(name);
        return lookup(beside) ? beside : std::string(name);
    }

    void add(const std::string& name, const std::string& named_by)
    {
        if (!seen.insert(name).second) return;
        const std::optional<std::string_view> content = lookup(name);
        if (!content) throw Error(ErrorCode::internal, "kernel file " + name + ", named by " + named_by + ", is not in the library");

        text += "#line 1 \"" + name + "\"\n";
        int number = 0;
        for (std::string_view rest = *content; !rest.empty();) {
            const std::string_view line = rest.substr(0, rest.find('\n'));
            rest.remove_prefix(std::min(line.size() + 1, rest.size()));
            ++number;
            if (const auto included = included_name(line)) {
                add(resolve(*included, name), name + ':' + std::to_string(number));
                text += "#line " + std::to_string(number + 1) + " \"" + name + "\"\n";
            } else {
                // Every file comes once anyhow; compilers warn of the pragma in a main file.
                if (!is_pragma_once(line)) text += line;
                text += '\n';
            }
        }
    }
};

} // namespace

std::string_view kernel_file(std::string_view name)
{
    const std::optional<std::string_view> text = embedded(name);
    if (!text) throw Error(ErrorCode::internal, "kernel file " + std::string(name) + " is not in the library");
    return *text;
}

std::string program_text(const Specialisation& specialisation, const FileLookup& lookup)
{
    Expansion expansion{lookup};
    for (const auto& [name, value] : specialisation.constants) expansion.text += "#define " + name + ' ' + value + '\n';
    expansion.add(specialisation.file, "a specialisation");
    return std::move(expansion.text);
}

std::string program_text(const Specialisation& specialisation) { return program_text(specialisation, embedded); }

} // namespace penumbra::opencl
