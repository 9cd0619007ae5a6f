// What keeps another site's page from using a visitor's browser against the service.
#pragma once

#include <string_view>

namespace penumbra::server {

// Whether a Host header (without its port) may be answered: an IP address, localhost, or one of `names` (separated by commas). Any other
// name may have been pointed here by whoever owns it (DNS rebinding).
bool is_known_host(std::string_view host_header, std::string_view names);

// Whether a request that carries this Origin comes from the service's own page, or from an origin of the list (whole origins, separated by
// commas). An empty one, of what is no browser, does.
bool is_own_origin(std::string_view origin, std::string_view host_header, std::string_view origins);

} // namespace penumbra::server
