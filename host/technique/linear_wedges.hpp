// Planes of Paper I's linear wedges, as kernels/common/wedge_linear.clh reads them. Plain arrays; no device.
//
// Source: Akenine-Moller and Assarsson, Approximate Soft Shadows on Arbitrary Surfaces using Penumbra Wedges (2002; Paper I), 4.1, 4.2
// and 8.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "silhouette/silhouette.hpp"
#include "technique/wedge_data.hpp"

namespace penumbra {

struct LinearWedges {
    Silhouette silhouette;           // with an edge from a vertex to itself for each wedge at a corner
    std::vector<float> planes;       // WEDGE_PLANES floats for each of its edges
    double reach_x = 1, reach_y = 1; // how far wedges reach, in the part's half extents: see boxes_meet in soft_shadow_volume.cl
    std::uint64_t corner_wedges = 0;
    std::uint64_t left_out = 0; // edges that point at the light's centre
    std::uint64_t unshared =
        0; // corners whose two wedges do not meet in one plane that holds the lines of their front and of their back planes
};

// Wedges of a sphere around the part's centre: of the light's radius, or of half a rectangle's diagonal.
//
// The side plane at a vertex holds the line where the neighbours' front planes meet, and that of their back planes (4.1). There is none, or
// a useless one, where
//   - the neighbours lie in line, by what rounding of the vertices lets tell: then it holds the ray through the vertex and the mean of
//     the two hard quads' normals, as it does in the limit;
//   - a line is not there, or reaches beyond twice the corner's mitre (edges that descend so steeply that one end hides in the penumbra
//     of the other): likewise; and where that is no better, or the corner is sharper than 2^-5 rad, each wedge ends at its own normal.
// Neighbours that share the first kind of plane add up to a continuous share. What others do not have in common is a step along the plane:
// nearly none between neighbours in line, up to the whole ramp where each ends at its own normal (`unshared`; corner wedges are the cure).
//
// An edge is left out where rounding decides about its normal: it points at the light's centre (8). Its neighbours then meet as above.
//
// `most_at_corners`: at a corner whose edges enclose less than a right angle, seen from the light, round up n (90 - angle) / 90 wedges turn
// from one normal to the next in equal steps (Fig. 7).
LinearWedges linear_wedges(const Topology& topology, Silhouette silhouette, const LightFrame& light, const LightPart& part, bool smooth,
                           int most_at_corners);

// The planes in the order of the wedge data's edges, padding between.
std::vector<float> planes_in_order(const LinearWedges& wedges, const WedgeData& data);

} // namespace penumbra
