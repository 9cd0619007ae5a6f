// Settings of smoothie.
#pragma once

#include <penumbra/technique/preset.hpp>

namespace penumbra {

enum class SmoothieWidth { light, t };
enum class SilhouetteSource { object, image };
enum class Falloff { sinusoidal, linear };

// Smoothies (Chan, Durand, Rendering Fake Soft Shadows with Smoothies, 2003): a shadow map whose silhouettes wear fins that fade to light
// outwards.
struct Smoothie {
    Preset preset = Preset::best; // what the other settings started from
    SmoothieWidth t_from =
        SmoothieWidth::light; // light: a smoothie is as wide as the outer half of the penumbra that the light's size casts
    double t = 0.05;          // t_from t: the paper's t, where the light's image is 2 wide along its wider side
    SilhouetteSource silhouettes =
        SilhouetteSource::object;          // of the objects that cast (the paper's section 3), or of the depth map (its section 6)
    Falloff falloff = Falloff::sinusoidal; // 3.1
    bool two_sided = true;                 // beyond the paper: an inner fin too, half lit at the silhouette
    double bias = 1.0;                     // as of ShadowMap
    double tolerance = 0; // not used: its penumbrae are not the light's, and every receiver is computed (docs/tolerance.md)
};

} // namespace penumbra
