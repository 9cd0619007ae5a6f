// Casters as soft_shadow_silhouettes' kernel reads them: every edge with the planes of the triangles beside it, every triangle, in groups
// with boxes for culling. Plain arrays; no device. Made once a light: it is each receiver that finds its own silhouettes.
#pragma once

#include <cstdint>
#include <vector>

#include "technique/wedge_data.hpp"

namespace penumbra {

// The light as the kernel has it: from its corner -u -v on, in its whole width and height.
LightPart corner_part(const LightFrame& light);

struct ReceiverSilhouettes {
    int edge_supers = 0, edge_groups = 0, triangle_supers = 0, triangle_groups = 0; // groups of 16 groups, groups of 16
    std::vector<float> edge_super_boxes, edge_group_boxes;         // blocks of 16 boxes, 13 x 16 floats each (BOX_ROWS)
    std::vector<float> edge_sets;                                  // 16 x 16 floats a group (EDGE_ROWS)
    std::vector<float> triangle_super_boxes, triangle_group_boxes; // blocks of 16 boxes, 5 x 16 floats each
    std::vector<float> triangle_sets;                              // 16 x 16 floats a group (TRIANGLE_ROWS)
    std::uint64_t edge_count = 0, triangle_count = 0;              // before padding; edges between triangles of one plane are none
};

// What lies behind the light's plane is cut off there. An edge of more than two triangles stands there once for every two of them.
ReceiverSilhouettes receiver_silhouettes(const Topology& topology, const LightFrame& light, const LightPart& corner);

} // namespace penumbra
