#include <penumbra/client.hpp>

bool unused(const penumbra::client::Client& service) { return service.ready(); }
