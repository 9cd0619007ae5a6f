#include "http/browser_guard.hpp"

#include <algorithm>
#include <string>

#include <arpa/inet.h>

namespace penumbra::server {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same(std::string_view a, std::string_view b)
{
    return std::ranges::equal(a, b, [](char x, char y) { return lower(x) == lower(y); });
}

bool in_list(std::string_view wanted, std::string_view list)
{
    while (!list.empty()) {
        const std::size_t end = std::min(list.find(','), list.size());
        std::string_view entry = list.substr(0, end);
        while (entry.starts_with(' ')) entry.remove_prefix(1);
        while (entry.ends_with(' ')) entry.remove_suffix(1);
        if (!entry.empty() && same(entry, wanted)) return true;
        list.remove_prefix(std::min(end + 1, list.size()));
    }
    return false;
}

bool is_address(const std::string& text)
{
    in6_addr address{};
    if (text.starts_with('[') && text.ends_with(']')) return inet_pton(AF_INET6, text.substr(1, text.size() - 2).c_str(), &address) == 1;
    return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

std::string_view without_port(std::string_view host)
{
    const std::size_t colon = host.rfind(':');
    return colon == std::string_view::npos || host.ends_with(']') ? host : host.substr(0, colon);
}

} // namespace

bool is_known_host(std::string_view host_header, std::string_view names)
{
    const std::string_view host = without_port(host_header);
    return is_address(std::string(host)) || same(host, "localhost") || in_list(host, names);
}

bool is_own_origin(std::string_view origin, std::string_view host_header, std::string_view origins)
{
    if (origin.empty() || in_list(origin, origins)) return true;
    const std::size_t scheme = origin.find("://");
    return scheme != std::string_view::npos && same(origin.substr(scheme + 3), host_header);
}

} // namespace penumbra::server
