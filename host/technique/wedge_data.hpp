// Silhouettes as soft_shadow_volume's kernel reads them: light space, boxes for culling, groups. Plain arrays; no device.
#pragma once

#include <cstdint>
#include <vector>

#include "common/shared.h"
#include "scene/light_space.hpp"
#include "silhouette/silhouette.hpp"

namespace penumbra {

// The point that silhouettes are seen from, and what lengths are counted in: a light, or a part of a rectangle.
struct LightPart {
    Vec3 centre;               // world
    Vec3 half;                 // units of light-space x, y and z: half extents and 1 for a rectangle; the radius for a disc
    double centre_x, centre_y; // of the part, from the light's centre, in `half`
    double share;              // of the whole light
};

// n x n parts of a rectangle; of any other light one. An extent of 0 beside another counts as 2^-12 of that; two of 0 as 1, which no edge
// is then tested against.
std::vector<LightPart> light_parts(const LightFrame& light, int splits);

// A point of the world in the part's light space, in `half`, as the device has it: rounded to binary32, from the whole light's centre and
// then from the part's.
Vec3 point_in_part(const LightFrame& light, const LightPart& part, const Vec3& point);

constexpr std::uint32_t no_edge = 0xffffffff;

// The triangles that face some part of a light, once for all of them: in `half` of the parts, from the whole light's centre. The kernel moves
// them to the part's.
struct WedgeTriangles {
    struct Box {
        double low_x, high_x, low_y, high_y, far, near; // x / z, y / z, 1 / z
    };
    std::vector<float> rows;         // 16 floats a triangle
    std::vector<float> extents;      // 6 x 16 floats a group: the box of each
    std::vector<std::uint32_t> rows_of; // of each triangle of the topology its row; no_edge: it faces no part
    std::vector<Box> boxes;          // of groups
};

// Of all `parts` of the light, which are of one size.
WedgeTriangles wedge_triangles(const Topology& topology, const LightFrame& light, const std::vector<LightPart>& parts);

struct WedgeData {
    std::vector<Sheet> sheets;
    std::vector<float> sheet_boxes, edge_boxes, triangle_boxes; // blocks of 16 boxes, 5 x 16 floats each
    std::vector<float> edge_ends;                               // 6 x 16 floats a group
    std::vector<float> edges;                                   // 8 floats an edge
    std::vector<std::uint32_t> edge_sources;                    // of each row of `edges`, its number in the silhouette; no_edge: padding
    // Pairs: a group of WedgeTriangles; which of its 16 triangles face the part (a bit each), and 16 bits up which of those turn clockwise
    // in order of their vertices' numbers.
    std::vector<int> triangle_groups;
    std::uint64_t edge_count = 0, triangle_count = 0;           // before padding
};

// `apart`: each sheet for itself. Else all as one, but for the components that show both their sides: the two sides of each are a pair of
// sheets (Sheet::side), of which the kernel takes the one that hides more. Without `edges_too` there are triangles alone (a light of no
// extent). What lies behind the light's plane is left out, but for a disc, whose plane turns with the receiver.
WedgeData wedge_data(const Topology& topology, const WedgeTriangles& triangles, const Silhouette& silhouette, const LightFrame& light,
                     const LightPart& part, bool apart, bool edges_too);

} // namespace penumbra
