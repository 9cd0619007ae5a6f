// Soft Shadow Volumes (Assarsson 2003): settings become device state, device state becomes masks.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "silhouette/silhouette.hpp"
#include "technique/receiver_points.hpp"
#include "technique/table.hpp"
#include "technique/verbs.hpp"
#include "technique/wedge_data.hpp"

namespace penumbra {

struct PreparedSoftShadowVolume {
    // What one part of the light needs.
    struct Part {
        WedgeLight light{};
        opencl::Buffer<Sheet> sheets;
        opencl::Buffer<float> coverage; // texture: the table; linear: the planes of wedges; else none
        opencl::Buffer<float> sheet_boxes, edge_boxes, edge_ends, edges, triangle_boxes;
        opencl::Buffer<cl_int> triangle_groups;
    };
    // What silhouettes from each receiver need.
    struct Counted {
        WedgeLight light{};
        cl_int2 edges{}, triangles{}; // groups of groups, groups
        opencl::Buffer<float> edge_supers, edge_groups, edge_sets, triangle_supers, triangle_groups, triangle_sets;
    };
    SoftShadowVolume settings;
    int channels = 1; // of the visibility: 3 for a coloured texture
    opencl::Specialisation program;
    opencl::Buffer<float> triangle_extents, triangle_rows; // of all parts
    std::vector<Part> parts;
    std::optional<Counted> counted; // instead of parts
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

// The view that receivers are to come in: of a right angle, so that xi and eta are tangents.
Camera wedge_view(const Light& light);

// Writes visibility, receivers.view.height x receivers.view.width x prepared.channels. With `counts` it waits for the device to fill them
// in.
void shade_soft_shadow_volume(opencl::Work& work, const PreparedSoftShadowVolume& prepared, const ReceiverPoints& receivers,
                              const cl::Buffer& visibility, ShadeCounts* counts);

// The verbs (verbs.hpp).
TechniqueRow row(const SoftShadowVolume&);
Needs needs(const SoftShadowVolume&);
void check_together(const SoftShadowVolume& settings);
PreparedSoftShadowVolume prepare(opencl::Work& work, const Casting& casting, const SoftShadowVolume& settings, Findings& findings);
void shade(opencl::Work& work, const PreparedSoftShadowVolume& prepared, const Receiving& receivers, Shaded& shaded);
std::vector<WorkAmount> work(const SoftShadowVolume& settings, const MaskShape& shape);
std::vector<opencl::Specialisation> specialisations(const SoftShadowVolume& settings, int lanes);
DeviceBuffers device_buffers(const SoftShadowVolume& settings);
// Has the bits of preparing anew; silhouettes stay on the same buffers.
PreparedSoftShadowVolume with_emission(opencl::Work& work, const PreparedSoftShadowVolume& prepared, const Light& light);

} // namespace penumbra
