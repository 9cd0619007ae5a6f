// Soft Shadow Volumes (Assarsson 2003): settings become device state, device state becomes masks.
#pragma once

#include <string>
#include <vector>

#include "silhouette/silhouette.hpp"
#include "technique/receiver_points.hpp"
#include "technique/soft_shadow_map.hpp"
#include "technique/wedge_data.hpp"

namespace penumbra {

struct PreparedSoftShadowVolume {
    // What one part of the light needs.
    struct Part {
        WedgeLight light{};
        opencl::Buffer<Sheet> sheets;
        opencl::Buffer<float> coverage; // texture: the table; linear: the planes of wedges; else none
        opencl::Buffer<float> sheet_boxes, edge_boxes, edge_ends, edges, triangle_boxes, triangle_extents, triangles;
    };
    SoftShadowVolume settings;
    int channels = 1; // of the visibility: 3 for a coloured texture
    opencl::Specialisation program;
    std::vector<Part> parts;
    std::uint64_t edges = 0, triangles = 0, sheets = 0; // of all parts
    std::vector<std::string> warnings;
};

// What casts, and the texel of the depth map that it was made from (tangents; 0 for triangles).
struct Casters {
    const Topology& topology;
    Vec2 texel{0, 0};
};

// Throws invalid_input for settings that the light does not go with.
PreparedSoftShadowVolume prepare_soft_shadow_volume(opencl::Work& work, const Light& light, const Casters& casters,
                                                    const SoftShadowVolume& settings);

// The same silhouettes, on the same buffers, under the emission of `light`, which is otherwise the light that they were prepared for: what
// depends on emission alone is computed. Has the bits of preparing anew.
PreparedSoftShadowVolume with_emission_of(opencl::Work& work, const PreparedSoftShadowVolume& prepared, const Light& light);

// The view that receivers are to come in: of a right angle, so that xi and eta are tangents.
Camera wedge_view(const Light& light);

// Writes visibility, receivers.view.height x receivers.view.width x prepared.channels. With `counts` it waits for the device to fill them
// in.
void shade_soft_shadow_volume(opencl::Work& work, const PreparedSoftShadowVolume& prepared, const ReceiverPoints& receivers,
                              const cl::Buffer& visibility, ShadeCounts* counts);

} // namespace penumbra
