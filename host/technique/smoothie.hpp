// Smoothies (Chan, Durand 2003): settings become device state, device state becomes masks.
#pragma once

#include <vector>

#include "silhouette/silhouette.hpp"
#include "technique/occluder_maps.hpp"
#include "technique/receiver_points.hpp"
#include "technique/table.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

// Silhouette edges in the light's image, in groups with boxes, as the kernels search them.
struct SmoothieEdges {
    std::vector<float> boxes;      // of groups: blocks of 16, 5 x 16 floats
    std::vector<float> edge_boxes; // of the edges of each group: 5 x 16 floats
    std::vector<float> edges;      // 8 floats an edge: both ends' x and y, both disparities, 1 / length^2
    int groups = 0;
    std::uint64_t count = 0; // edges before the light's plane
};

// `camera`: the light's own. Edges are cut where they come nearer to its plane than 2^-10 of the furthest; what lies behind it casts
// nothing.
SmoothieEdges smoothie_edges(const Topology& topology, const Silhouette& silhouette, const Camera& camera);

struct PreparedSmoothie {
    Smoothie settings;
    opencl::Specialisation program;
    OccluderView occluders{};
    SmoothieView view{};
    double precision = 0;
    OccluderMap map;
    opencl::Buffer<float> boxes, edge_boxes, edges;
};

// Throws invalid_input for settings that do not go together.
PreparedSmoothie prepare_smoothie(opencl::Work& work, const OccluderDepth& depth, const SmoothieEdges& edges, const Smoothie& settings);

// Writes visibility, receivers.view.height x receivers.view.width. Of `wanted`: says the estimate before the search for edges, and counts it.
void shade_smoothie(opencl::Work& work, const PreparedSmoothie& prepared, const ReceiverPoints& receivers, const cl::Buffer& visibility,
                    Shaded* wanted = nullptr);

// The verbs (verbs.hpp).
TechniqueRow row(const Smoothie&);
Needs needs(const Smoothie&);
PreparedSmoothie prepare(opencl::Work& work, const Casting& casting, const Smoothie& settings, Findings& findings);
void shade(opencl::Work& work, const PreparedSmoothie& prepared, const Receiving& receivers, Shaded& shaded);
std::vector<WorkAmount> work(const Smoothie& settings, const MaskShape& shape);
std::vector<opencl::Specialisation> specialisations(const Smoothie& settings, int lanes);
DeviceBuffers device_buffers(const Smoothie& settings);

} // namespace penumbra
