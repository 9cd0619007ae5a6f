#include "masks/multipart.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "process/problem.hpp"

namespace penumbra::server {
namespace {

constexpr std::size_t max_part_header_bytes = 4096;

Problem malformed(const std::string& what) { return Problem(400, "multipart", "the multipart body " + what); }

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same(std::string_view a, std::string_view b)
{
    return std::ranges::equal(a, b, [](char x, char y) { return lower(x) == lower(y); });
}

std::string_view trimmed(std::string_view text)
{
    const auto blank = [](char c) { return c == ' ' || c == '\t'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    return text;
}

bool is_token(char c)
{
    return (c >= '0' && c <= '9') || (lower(c) >= 'a' && lower(c) <= 'z') ||
           std::string_view("!#$%&'*+-.^_`|~").find(c) != std::string_view::npos;
}

// "; name=value" or "; name="quoted"", the next one of `rest`; nothing when `rest` is no parameter.
std::optional<std::pair<std::string_view, std::string>> next_parameter(std::string_view& rest)
{
    rest = trimmed(rest);
    if (rest.empty() || rest.front() != ';') return {};
    rest = trimmed(rest.substr(1));
    std::size_t end = 0;
    while (end < rest.size() && is_token(rest[end])) ++end;
    const std::string_view name = rest.substr(0, end);
    if (name.empty() || end == rest.size() || rest[end] != '=') return {};
    rest.remove_prefix(end + 1);

    std::string value;
    if (rest.empty() || rest.front() != '"') {
        end = std::min(rest.find_first_of("; \t"), rest.size());
        value = rest.substr(0, end);
        rest.remove_prefix(end);
        return {{name, value}};
    }
    for (std::size_t i = 1; i < rest.size(); ++i) {
        if (rest[i] == '"') {
            rest.remove_prefix(i + 1);
            return {{name, value}};
        }
        if (rest[i] == '\\' && i + 1 < rest.size()) ++i;
        value += rest[i];
    }
    return {};
}

// The parameter `wanted` of `text`, which begins with the word `kind`. Throws for parameters that cannot be read and for two of that name.
std::optional<std::string> parameter(std::string_view text, std::string_view kind, std::string_view wanted)
{
    std::string_view rest = text.substr(kind.size());
    std::optional<std::string> found;
    while (const auto next = next_parameter(rest)) {
        if (!same(next->first, wanted)) continue;
        if (found) throw malformed("has a header with two values of " + std::string(wanted));
        found = next->second;
    }
    if (!trimmed(rest).empty()) throw malformed("has a header that cannot be read: " + std::string(kind));
    return found;
}

std::string_view first_word(std::string_view text) { return trimmed(text.substr(0, text.find(';'))); }

std::string name_from(std::string_view headers)
{
    std::optional<std::string> name;
    while (!headers.empty()) {
        const std::size_t end = std::min(headers.find("\r\n"), headers.size());
        const std::string_view line = headers.substr(0, end);
        headers.remove_prefix(std::min(end + 2, headers.size()));
        const std::size_t colon = line.find(':');
        if (colon == std::string_view::npos) throw malformed("has a part with a line that is no header");
        const std::string_view field = line.substr(0, colon), value = trimmed(line.substr(colon + 1));
        if (same(field, "Content-Transfer-Encoding") && !same(value, "binary") && !same(value, "8bit") && !same(value, "7bit"))
            throw Problem(415, "encoding", "a part has a Content-Transfer-Encoding; expected the bytes as they are");
        if (!same(field, "Content-Disposition")) continue;
        if (name) throw malformed("has a part with two Content-Disposition headers");
        const std::string_view kind = first_word(value);
        if (!same(kind, "form-data")) throw malformed("has a part that is no form-data");
        name = parameter(value, kind, "name");
        if (!name) throw malformed("has a part without a name");
    }
    if (!name) throw malformed("has a part without Content-Disposition");
    if (!is_part_name(*name))
        throw malformed("has a part with a name that is not allowed; expected 1 to 128 of A-Z a-z 0-9 . _ - with no . at the start");
    return *name;
}

} // namespace

std::string boundary_of(std::string_view content_type)
{
    const std::string_view kind = first_word(content_type);
    if (!same(kind, "multipart/form-data"))
        throw Problem(415, "media_type", "Content-Type: expected multipart/form-data with a part `scene` and one for each image it names");
    content_type = trimmed(content_type);
    std::string boundary = parameter(content_type, kind, "boundary").value_or("");
    // RFC 2046, 5.1.1; the space, which it allows inside, no client uses.
    const bool allowed = std::ranges::all_of(boundary, [](char c) {
        return (c >= '0' && c <= '9') || (lower(c) >= 'a' && lower(c) <= 'z') ||
               std::string_view("'()+_,-./:=?").find(c) != std::string_view::npos;
    });
    if (boundary.empty() || boundary.size() > 70 || !allowed)
        throw Problem(400, "multipart", "Content-Type: expected a boundary of 1 to 70 of the characters that RFC 2046 allows");
    return boundary;
}

bool is_json(std::string_view content_type)
{
    const std::string_view kind = first_word(content_type);
    return same(kind, "application/json") || same(kind, "application/merge-patch+json");
}

bool is_part_name(std::string_view name)
{
    return !name.empty() && name.size() <= 128 && name.front() != '.' && std::ranges::all_of(name, [](char c) {
        return (c >= '0' && c <= '9') || (lower(c) >= 'a' && lower(c) <= 'z') || c == '.' || c == '_' || c == '-';
    });
}

std::vector<Part> parse_multipart(std::string_view body, std::string_view boundary, std::size_t max_parts)
{
    const std::string opening = "--" + std::string(boundary), delimiter = "\r\n" + opening;
    if (!body.starts_with(opening)) throw malformed("does not begin with its boundary");
    body.remove_prefix(opening.size());

    std::vector<Part> parts;
    while (!body.starts_with("--")) {
        // What follows a delimiter is the end of its line, then headers up to an empty line.
        while (!body.empty() && (body.front() == ' ' || body.front() == '\t')) body.remove_prefix(1);
        if (!body.starts_with("\r\n")) throw malformed("is truncated or has a broken delimiter");
        const std::string_view window = body.substr(0, max_part_header_bytes + 4);
        const std::size_t headers = window.find("\r\n\r\n");
        if (headers == std::string_view::npos)
            throw malformed(window.size() == body.size()
                                ? "is truncated inside the headers of a part"
                                : "has a part with headers of more than " + std::to_string(max_part_header_bytes) + " bytes");
        if (headers == 0) throw malformed("has a part without headers");
        if (parts.size() == max_parts)
            throw Problem(413, "parts", "the request has more than " + std::to_string(max_parts) + " parts, the limit");
        Part part{name_from(body.substr(2, headers - 2)), {}};
        if (std::ranges::any_of(parts, [&](const Part& other) { return other.name == part.name; }))
            throw malformed("has two parts named \"" + part.name + "\"");
        body.remove_prefix(headers + 4);

        // Linear for any content: memmem is a two-way search.
        const void* at = memmem(body.data(), body.size(), delimiter.data(), delimiter.size());
        if (!at) throw malformed("is truncated: part \"" + part.name + "\" has no end");
        const std::size_t length = static_cast<std::size_t>(static_cast<const char*>(at) - body.data());
        part.bytes = body.substr(0, length);
        body.remove_prefix(length + delimiter.size());
        parts.push_back(std::move(part));
    }
    return parts;
}

} // namespace penumbra::server
