// The rows of the table, each defined beside its technique. A new technique adds one line here and one in table.cpp.
#pragma once

#include "technique/table.hpp"

namespace penumbra {

TechniqueRow shadow_map_row();
TechniqueRow soft_shadow_map_row();
TechniqueRow soft_shadow_volume_row();
TechniqueRow occlusion_texture_row();
TechniqueRow smoothie_row();
TechniqueRow ray_traced_row();

} // namespace penumbra
