// Which settings a technique starts from.
#pragma once

namespace penumbra {

// best (`default` in scene files): the best that was measured. paper: as published. In a scene file the other keys are changes to it.
enum class Preset { best, paper };

} // namespace penumbra
