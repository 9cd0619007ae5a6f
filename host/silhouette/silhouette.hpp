// The silhouette room: what casts, as one point sees it. Triangles and edges alone; knows no OpenCL and no rays.
//
// Source: Assarsson, A Real-Time Soft Shadow Volume Algorithm (2003), Papers III (3.1) and V. The silhouette is taken as the boundary of
// the set of triangles that face the point: each edge once for every facing triangle beside it, opposite directions cancelling. A boundary
// has no boundary, so edges always close into loops and every vertex has as many that come as go (Paper V: an even degree), for any soup of
// triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra {

// How triangles hang together; independent of any light. Vertices of one mesh at exactly the same place are one (-0 is 0); meshes stay
// apart. Throws invalid_input for an index beyond a mesh's vertices, too_large beyond 2^32 / 3 triangles.
class Topology {
public:
    explicit Topology(std::span<const TriangleMesh* const> meshes);

    std::span<const Imath::V3f> vertices() const { return vertices_; }

    // In the order of the meshes, without those of no area or with coordinates that are not finite. Closed components are wound
    // counter-clockwise seen from outside, whatever the file said, where their triangles can be wound alike at all; of others the winding
    // means nothing.
    std::span<const std::array<std::uint32_t, 3>> triangles() const { return triangles_; }

    // Whether the triangle belongs to a component (triangles joined by edges) whose every edge is passed as often one way as the other.
    // Only the facing side of such a one counts; of any other both sides cast. What is joined by edges of two triangles and closed so is a
    // component by itself, whatever else touches it along an edge.
    bool closed(std::uint32_t triangle) const { return closed_[triangle] != 0; }

    // The number of the triangle's component, below `triangles().size()`; of an open one, of all the patches that it is made of.
    std::uint32_t component(std::uint32_t triangle) const { return component_[triangle]; }

    std::uint64_t open_edges() const { return open_edges_; }               // of one triangle
    std::uint64_t nonmanifold_edges() const { return nonmanifold_edges_; } // of more than two
    std::uint64_t left_out() const { return left_out_; }                   // triangles
    std::uint64_t bytes() const;                                           // of memory that it holds

    // Side `corner` of a triangle, from its vertex `corner` to the next.
    struct EdgeUse {
        std::uint32_t low, high; // vertices, low < high
        std::uint32_t triangle;
        std::uint8_t corner; // 0, 1, 2
        bool forward;        // the triangle passes it from low to high
    };
    std::span<const EdgeUse> edge_uses() const { return edge_uses_; } // in order of (low, high, triangle)

private:
    void turn(const std::vector<std::uint8_t>& turned);

    std::vector<Imath::V3f> vertices_;
    std::vector<std::array<std::uint32_t, 3>> triangles_;
    std::vector<std::uint8_t> closed_;
    std::vector<std::uint32_t> component_;
    std::vector<EdgeUse> edge_uses_;
    std::uint64_t open_edges_ = 0, nonmanifold_edges_ = 0, left_out_ = 0;
};

struct SilhouetteEdge {
    std::uint32_t from, to; // vertices of the topology; seen from the point, what faces it lies on the left
    std::uint32_t sheet;    // whose border it is
};

// Which side of which surface a sheet is.
struct SheetSide {
    std::uint32_t component; // Topology::component of its triangles
    bool turned;             // most of its triangles are wound clockwise, seen from the point; never of a closed component
};

// A sheet: facing triangles joined by edges that two of them pass in opposite directions. Where more than two meet at an edge they are
// paired off, one each way, in the order of the triangles; those left over end there.
//
// Of a component that is wound alike a sheet shows one side alone: across an edge from the one side to the other both triangles pass it the
// same way, and two sheets end there. Of one that is not (a Moebius strip; three patches at an edge) a sheet can hold triangles of both: it
// stays whole, and counts as the side that most of its triangles show.
struct Silhouette {
    // Triangles that face the point, wound counter-clockwise seen from it; those of one sheet beside each other.
    std::vector<std::array<std::uint32_t, 3>> facing;
    std::vector<std::uint32_t> facing_numbers; // of each, in the topology
    std::vector<std::uint32_t> facing_begin; // sheet s has facing [facing_begin[s], facing_begin[s + 1])
    std::vector<SheetSide> sides;            // of each sheet

    // Loop after loop, each edge from where the one before ends; an edge at which n triangles end stands there n times. At a vertex of more
    // than two edges a loop goes on around the fan of its own facing triangles, so each loop borders one sheet.
    std::vector<SilhouetteEdge> edges;
    std::vector<std::uint32_t> loop_begin; // loop i has edges [loop_begin[i], loop_begin[i + 1])

    std::size_t sheets() const { return facing_begin.empty() ? 0 : facing_begin.size() - 1; }
    std::size_t loops() const { return loop_begin.empty() ? 0 : loop_begin.size() - 1; }
};

// As seen from `point` (world space), judged in double precision. A triangle that the point lies in the plane of does not face it. Throws
// invalid_input for a point that is not finite.
Silhouette silhouette_of(const Topology& topology, const Vec3& point);

// The surfaces that a depth map shows, for silhouettes at its depth jumps (McCool 2000): each texel that has depth a quad of two triangles
// that face the camera, closed up to the texel's borders. Neighbours share a side where their step is explained (`joined`); otherwise each
// ends there. A corner lies at the mean, over the texels joined around it, of their disparities (an orthographic camera's: depths); where
// those are fewer than four, each is first extended to the corner by its own slope, unless that would reach beyond the horizon. So a plane
// comes out plane up to its border.
TriangleMesh mesh_of_texels(const DepthMap& map, const Camera& camera);

// Whether neighbours a, b lie on one surface, from four values in a row (0: nothing there), each right to the relative `precision`. The
// values must be linear on planes: disparities, or depths of an orthographic camera.
//
// Let s be the slope on one side, a - before or after - b. A plane has b - a = s. A smooth surface that turns away goes as the square root
// of the distance to its limb, which steepens most when a texel's centre lies on the limb: sqrt(1) - sqrt(0) after sqrt(2) - sqrt(1),
// 1 + sqrt(2) times as much. So steps from 0 to (1 + sqrt(2)) s are explained, plus what rounding adds: precision (a + b) to the step and
// (1 + sqrt(2)) times precision (before + a) to the slope. Either side's explanation will do, since surfaces have creases.
// N.B. A single texel between two jumps of one direction and like size looks like a slope, and is joined.
bool joined(double before, double a, double b, double after, double precision);

} // namespace penumbra
