#include <penumbra/engine.hpp>

namespace penumbra {

std::string version() { return PENUMBRA_VERSION; }

} // namespace penumbra
