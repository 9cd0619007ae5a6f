// Silhouettes as arrays for the kernel: what is counted, padded and boxed.
#include "technique/soft_shadow_volume_run.hpp"

#include "technique/wedge_data.hpp"

#include <bit>

namespace penumbra::test {
namespace {

WedgeData data_of(const std::vector<TriangleMesh>& meshes, const Light& light, bool apart = true, bool edges_too = true, int splits = 1,
                  std::size_t part = 0)
{
    const LightFrame frame = light_frame(light);
    const Topology topology = topology_of(meshes);
    const std::vector<LightPart> parts = light_parts(frame, splits);
    const LightPart own = parts.at(part);
    return wedge_data(topology, wedge_triangles(topology, frame, parts), silhouette_of(topology, own.centre), frame, own, apart, edges_too);
}

TEST(LightParts, CoverTheRectangle)
{
    const LightFrame frame = light_frame(rectangle_light(0.75, 0.5));
    for (const int splits : {1, 2, 3, 16}) {
        const std::vector<LightPart> parts = light_parts(frame, splits);
        ASSERT_EQ(parts.size(), static_cast<std::size_t>(splits * splits));
        double share = 0, low = 1e9, high = -1e9;
        Vec3 middle(0, 0, 0);
        for (const LightPart& part : parts) {
            share += part.share;
            middle += part.centre * part.share;
            low = std::min(low, part.centre.x - part.half.x);
            high = std::max(high, part.centre.x + part.half.x);
            EXPECT_DOUBLE_EQ(part.half.y, 0.5 / splits);
            EXPECT_NEAR(part.centre_x * part.half.x, part.centre.x, 1e-15); // a few roundings of numbers below 1
            EXPECT_NEAR(part.centre_y * part.half.y, part.centre.y, 1e-15);
        }
        EXPECT_NEAR(share, 1, splits * splits * 0x1p-53);
        EXPECT_NEAR(low, -0.75, 1e-15);
        EXPECT_NEAR(high, 0.75, 1e-15);
        EXPECT_NEAR(middle.length(), 0, 1e-15);
    }
}

TEST(LightParts, LightsWithoutExtent)
{
    const std::vector<LightPart> line = light_parts(light_frame(rectangle_light(2, 0)), 2);
    ASSERT_EQ(line.size(), 4u);
    EXPECT_EQ(line[0].half.y, 2 * 0x1p-12 / 2);
    for (const Light& light : {Light(point_light()), Light(sphere_light(0))}) {
        const std::vector<LightPart> point = light_parts(light_frame(light), 3);
        ASSERT_EQ(point.size(), 1u);
        EXPECT_EQ(point[0].half, Vec3(1, 1, 1));
        EXPECT_EQ(point[0].share, 1);
    }
    EXPECT_EQ(light_parts(light_frame(sphere_light(0.25)), 1).front().half, Vec3(0.25, 0.25, 0.25));
}

TEST(WedgeData, CountsAndPadding)
{
    const std::vector<TriangleMesh> meshes = {sheet(-1, 1, -1, 1, 4), closed_box({2, 2, 3}, {3, 3, 5})};
    const WedgeData apart = data_of(meshes, rectangle_light(1, 1));
    EXPECT_EQ(apart.sheets.size(), 2u);
    EXPECT_EQ(apart.edge_count, 4u + 6u); // the box shows its centre three faces
    EXPECT_EQ(apart.triangle_count, 2u + 6u);
    EXPECT_EQ(apart.edges.size(), 2u * WEDGE_GROUP * 8);
    EXPECT_EQ(apart.edge_ends.size(), 2u * WEDGE_GROUP * 6);
    EXPECT_EQ(apart.triangle_groups.size(), 2u * 2); // eight triangles of one group, in two sheets
    for (const std::vector<float>& boxes : {apart.sheet_boxes, apart.edge_boxes, apart.triangle_boxes}) EXPECT_EQ(boxes.size(), 80u);
    // What pads a group is passed in neither direction, covers nothing and is near nothing.
    for (std::size_t i = 4; i < WEDGE_GROUP; ++i) {
        EXPECT_EQ(apart.edges[8 * i + 6], 0.0F);
        EXPECT_EQ(apart.edge_ends[2 * 16 + i], -1.0F);
        EXPECT_EQ(apart.edge_ends[5 * 16 + i], -1.0F);
    }
    EXPECT_EQ(apart.triangle_groups[0], 0);
    EXPECT_EQ(apart.triangle_groups[2], 0);
    EXPECT_EQ((apart.triangle_groups[1] | apart.triangle_groups[3]) & 0xffff, 0xff);
    EXPECT_EQ(apart.triangle_groups[1] & apart.triangle_groups[3] & 0xffff, 0);

    const WedgeData together = data_of(meshes, rectangle_light(1, 1), false);
    EXPECT_EQ(together.sheets.size(), 1u);
    EXPECT_EQ(together.edge_count, apart.edge_count);
    EXPECT_EQ(together.triangle_count, apart.triangle_count);
    EXPECT_EQ(together.edges.size(), 1u * WEDGE_GROUP * 8);

    const WedgeData hard = data_of(meshes, point_light(), true, false);
    EXPECT_EQ(hard.edge_count, 0u);
    EXPECT_EQ(hard.triangle_count, 8u);

    const WedgeData none = data_of({}, rectangle_light(1, 1));
    EXPECT_TRUE(none.sheets.empty());
    EXPECT_EQ(none.sheet_boxes.size(), 80u); // still a block to read, which meets nothing
    EXPECT_EQ(none.sheet_boxes[64], -1.0F);
}

// Triangles are there once for all parts, those that face any of them; each part knows which face it, and has them where the kernel puts them.
TEST(WedgeData, TrianglesOfAllParts)
{
    std::vector<TriangleMesh> meshes = soup(60, {-6, -6, 1.5}, {6, 6, 12}, 3);
    meshes.push_back(closed_box({-1, -0.7, 3}, {1, 0.7, 5}));
    meshes.push_back(sheet(-1, 1, -1, 1, -2)); // behind the light
    const LightFrame frame = light_frame(rectangle_light(2, 1.5));
    const Topology topology = topology_of(meshes);
    const std::vector<LightPart> parts = light_parts(frame, 3);
    const WedgeTriangles triangles = wedge_triangles(topology, frame, parts);
    std::vector<int> faced(topology.triangles().size(), 0);
    std::uint64_t pairs = 0;
    for (const LightPart& part : parts) {
        const Silhouette silhouette = silhouette_of(topology, part.centre);
        ASSERT_EQ(silhouette.facing_numbers.size(), silhouette.facing.size());
        for (std::size_t i = 0; i < silhouette.facing.size(); ++i) {
            const std::uint32_t number = silhouette.facing_numbers[i], row = triangles.rows_of[number];
            ++faced[number];
            std::array<std::uint32_t, 3> own = silhouette.facing[i], whole = topology.triangles()[number];
            std::ranges::sort(own);
            std::ranges::sort(whole);
            ASSERT_EQ(own, whole);
            ASSERT_NE(row, no_edge);
            for (std::size_t c = 0; c < 3; ++c) {
                const Vec3 at = point_in_part(frame, part, Vec3(topology.vertices()[own[c]]));
                const float* const vertex = triangles.rows.data() + 16 * row + 3 * c;
                EXPECT_EQ(vertex[0] - static_cast<float>(part.centre_x), static_cast<float>(at.x));
                EXPECT_EQ(vertex[1] - static_cast<float>(part.centre_y), static_cast<float>(at.y));
                EXPECT_EQ(vertex[2], static_cast<float>(at.z));
            }
        }
        for (const bool apart : {false, true}) {
            const WedgeData data = wedge_data(topology, triangles, silhouette, frame, part, apart, true);
            std::uint64_t counted = 0;
            for (std::size_t i = 0; i < data.triangle_groups.size(); i += 2) counted += static_cast<std::uint64_t>(std::popcount(static_cast<std::uint32_t>(data.triangle_groups[i + 1]) & 0xffffU));
            EXPECT_EQ(counted, data.triangle_count);
            pairs += counted;
        }
    }
    EXPECT_GT(pairs, 2u * 9 * 40);
    // Kept though they face no part: only what rounding cannot tell.
    for (std::size_t t = 0; t < faced.size(); ++t) EXPECT_EQ(faced[t] > 0, triangles.rows_of[t] != no_edge) << t;
}

// What is closed or shows one side alone is one sheet; a surface that shows both sides two, after it, one behind the other.
TEST(WedgeData, SidesOfSurfacesThatAreNotClosed)
{
    const auto sides_of = [](const std::vector<TriangleMesh>& meshes, bool apart = false) {
        std::vector<int> sides;
        for (const Sheet& sheet : data_of(meshes, rectangle_light(1, 1), apart).sheets) sides.push_back(sheet.side);
        return sides;
    };
    const TriangleMesh beside = shell({0, 0, 5}, 1, {1, 0, 0}, 4, 8), upright = shell({2, 0, 5}, 1, {2, 0, 5}, 4, 8);
    TriangleMesh reversed = sheet(-1, 1, -1, 1, 4);
    for (auto& t : reversed.triangles) std::swap(t[0], t[1]);
    EXPECT_EQ(sides_of({closed_box({2, 2, 3}, {3, 3, 5}), sheet(-1, 1, -1, 1, 4), reversed, upright}), (std::vector{0}));
    EXPECT_EQ(sides_of({beside}), (std::vector{1, 2}));
    EXPECT_EQ(sides_of({beside, sheet(-1, 1, -1, 1, 4), shell({3, 3, 6}, 1, {1, 0, 0}, 4, 8)}), (std::vector{0, 1, 2, 1, 2}));
    EXPECT_EQ(sides_of({beside}, true), (std::vector{0, 0})); // of other overlaps

    // Each side has all its triangles, and its border: the rim's half and the fold.
    const WedgeData pair = data_of({beside}, rectangle_light(1, 1), false);
    EXPECT_EQ(pair.triangle_count, 16u * (2 * 4 - 1)); // at the pole of a quad one triangle is left
    const std::uint64_t edges = pair.edge_count;
    EXPECT_EQ(edges, data_of({beside}, rectangle_light(1, 1), true).edge_count);
    EXPECT_EQ(pair.sheets[1].triangles_begin, pair.sheets[0].triangles_end);
    EXPECT_EQ(pair.sheets[1].edges_begin, pair.sheets[0].edges_end);

    // All of one side behind the light's plane: the other is the first of its pair.
    TriangleMesh folded = mesh_of({{3, 0, 3}, {2, -1, -1}, {2, 1, -1}, {5, 0, -2}}, {{0, 1, 2}, {2, 1, 3}});
    EXPECT_EQ(data_of({folded}, sphere_light(1), false).sheets.size(), 2u); // of a disc everything counts
    for (int winding = 0; winding < 2; ++winding) {
        EXPECT_EQ(sides_of({folded}), (std::vector{1}));
        for (auto& t : folded.triangles) std::swap(t[0], t[1]);
    }
}

// In half extents from the part's centre, lower number first.
TEST(WedgeData, EdgesInTheUnitsOfTheLight)
{
    const WedgeData data = data_of({sheet(-1, 1, -2, 2, 4)}, rectangle_light(0.5, 0.25), true, true, 2, 3);
    const LightPart part = light_parts(light_frame(rectangle_light(0.5, 0.25)), 2).at(3);
    for (std::size_t i = 0; i < 4; ++i) {
        const float* edge = data.edges.data() + 8 * i;
        for (const std::size_t end : {0u, 3u}) {
            EXPECT_EQ(std::abs(edge[end] * part.half.x + part.centre.x), 1) << i;
            EXPECT_EQ(std::abs(edge[end + 1] * part.half.y + part.centre.y), 2) << i;
            EXPECT_EQ(edge[end + 2], 4.0F);
        }
        EXPECT_EQ(std::abs(edge[6]), 1.0F);
    }
}

// Behind the light's plane nothing hides anything from a rectangle; a disc turns with the receiver, so all may.
TEST(WedgeData, WhatLiesBehindTheLight)
{
    const std::vector<TriangleMesh> meshes = {sheet(-1, 1, -1, 1, -2), sheet(-1, 1, -1, 1, 4)};
    const WedgeData rectangle = data_of(meshes, rectangle_light(1, 1)), disc = data_of(meshes, sphere_light(1));
    EXPECT_EQ(rectangle.sheets.size(), 1u);
    EXPECT_EQ(rectangle.edge_count, 4u);
    EXPECT_EQ(disc.sheets.size(), 2u);
    EXPECT_EQ(disc.edge_count, 8u);
    // Across the plane: kept, and its box is everywhere.
    const WedgeData across = data_of({sheet({Vec3(2, -1, -1), Vec3(3, -1, 4), Vec3(3, 1, 4), Vec3(2, 1, -1)})}, rectangle_light(1, 1));
    EXPECT_EQ(across.edge_count, 3u); // the one that lies behind altogether is left out
    EXPECT_GE(across.sheet_boxes[64], 1e18F);
}

// Boxes hold what they are for: every end of every edge, every vertex, to within the rounding of a float.
TEST(WedgeData, BoxesHoldTheirContents)
{
    const WedgeData data = data_of(soup(200, {-5, -5, 1}, {5, 5, 9}, 4), rectangle_light(1, 0.5));
    ASSERT_GT(data.sheets.size(), 100u);
    for (std::size_t s = 0; s < data.sheets.size(); ++s) {
        const float* const boxes = data.sheet_boxes.data() + s / 16 * 80 + s % 16;
        for (int group = data.sheets[s].edges_begin; group < data.sheets[s].edges_end; ++group)
            for (std::size_t i = 0; i < WEDGE_GROUP; ++i) {
                const float* edge = data.edges.data() + (static_cast<std::size_t>(group) * WEDGE_GROUP + i) * 8;
                if (edge[6] == 0) continue;
                const float* own =
                    data.edge_boxes.data() + static_cast<std::size_t>(group) / 16 * 80 + static_cast<std::size_t>(group) % 16;
                for (const float* box : {own, boxes})
                    for (const std::size_t end : {0u, 3u}) {
                        const double x = static_cast<double>(edge[end]) / edge[end + 2], slack = 0x1p-22 * std::abs(x);
                        EXPECT_GE(x, box[0] - slack);
                        EXPECT_LE(x, box[16] + slack);
                        EXPECT_LE(1.0 / edge[end + 2], box[64] * (1 + 0x1p-22));
                    }
            }
    }
}

} // namespace
} // namespace penumbra::test
