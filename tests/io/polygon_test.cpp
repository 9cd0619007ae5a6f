#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "io/polygon.hpp"

using namespace penumbra;

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;
using Ring = std::vector<Vec3>;

double area(const Triangles& triangles, const Ring& p)
{
    double twice = 0;
    for (const auto& [a, b, c] : triangles) twice += (p[b] - p[a]).cross(p[c] - p[a]).z;
    return twice / 2;
}

double area(const Ring& p)
{
    double twice = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
        const Vec3 &a = p[i] - p[0], &b = p[(i + 1) % p.size()] - p[0];
        twice += a.x * b.y - a.y * b.x;
    }
    return twice / 2;
}

Triangles triangulated(const Ring& ring)
{
    Triangles triangles;
    triangulate(ring, triangles);
    return triangles;
}

// Each triangle turns as the polygon does and their areas add up: nothing lies outside, nothing twice.
void expect_covers(const Ring& ring)
{
    const Triangles triangles = triangulated(ring);
    EXPECT_EQ(triangles.size(), ring.size() - 2);
    double smallest = 0;
    for (const auto& triangle : triangles) smallest = std::min(smallest, area({triangle}, ring));
    const double rounding = 1e-12 * std::abs(area(ring));
    EXPECT_GE(smallest, -rounding);
    EXPECT_NEAR(area(triangles, ring), area(ring), rounding * static_cast<double>(ring.size()));
}

Ring star(int points, double inner)
{
    Ring ring;
    for (int i = 0; i < 2 * points; ++i) {
        const double angle = std::numbers::pi * i / points, r = i % 2 != 0 ? inner : 1;
        ring.emplace_back(r * std::cos(angle), r * std::sin(angle), 0);
    }
    return ring;
}

// A square of side 2 with holes that a cut joins to its border one after the other, each cut there and back.
Ring keyhole(int holes, int sides)
{
    Ring ring{{-1, -1, 0}};
    for (int h = 0; h < holes; ++h) {
        const Vec3 start = ring.back(), middle(-1 + 2 * (h + 0.5) / holes, 0, 0);
        const double radius = 0.6 / holes;
        const auto corner = [&](int i) {
            const double angle = -std::numbers::pi / 2 - 2 * std::numbers::pi * i / sides; // clockwise, from below
            return middle + Vec3(radius * std::cos(angle), radius * std::sin(angle), 0);
        };
        const Vec3 below(middle.x, -1, 0);
        if (below != start) ring.push_back(below);
        for (int i = 0; i <= sides; ++i) ring.push_back(corner(i % sides));
        ring.push_back(below);
    }
    ring.insert(ring.end(), {{1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
    return ring;
}

} // namespace

TEST(Polygon, ConcaveOnesKeepTheirAreaAndSense)
{
    const std::vector<Ring> polygons{
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},                                             // square
        {{0, 0, 0}, {2, -1, 0}, {0.5, 0, 0}, {2, 1, 0}},                                          // arrow head
        {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}}, // U
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}},                                             // a corner in a line
    };
    for (const Ring& polygon : polygons)
        for (std::size_t turn = 0; turn < polygon.size(); ++turn) {
            Ring ring = polygon;
            std::rotate(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(turn), ring.end());
            expect_covers(ring);
            std::reverse(ring.begin(), ring.end());
            EXPECT_EQ(area(triangulated(ring), ring), -area(polygon));
        }
}

TEST(Polygon, AnyNumberOfCorners)
{
    for (const int points : {5, 256, 257, 1000, 20000}) {
        SCOPED_TRACE(points);
        expect_covers(star(points, 0.3));
    }
    // A comb: no two teeth may be joined.
    Ring comb;
    for (int tooth = 0; tooth < 3000; ++tooth) comb.insert(comb.end(), {{2.0 * tooth, 1, 0}, {2.0 * tooth + 1, 0.01, 0}});
    comb.insert(comb.end(), {{6000, 0, 0}, {0, 0, 0}});
    std::reverse(comb.begin(), comb.end());
    expect_covers(comb);
}

TEST(Polygon, HolesThatACutJoinsToTheBorderStayOpen)
{
    for (const int holes : {1, 2, 5})
        for (const int sides : {3, 4, 7, 64, 300}) {
            SCOPED_TRACE(testing::Message() << holes << " holes of " << sides);
            Ring ring = keyhole(holes, sides);
            for (std::size_t turn = 0; turn < ring.size(); turn += 1 + ring.size() / 9) {
                std::rotate(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(turn), ring.end());
                const Triangles triangles = triangulated(ring);
                expect_covers(ring);
                for (int h = 0; h < holes; ++h) {
                    const Vec3 middle(-1 + 2 * (h + 0.5) / holes, 0, 0);
                    for (const auto& [a, b, c] : triangles) {
                        const auto left = [&](std::uint32_t i, std::uint32_t k) { return (ring[k] - ring[i]).cross(middle - ring[i]).z; };
                        EXPECT_FALSE(left(a, b) > 0 && left(b, c) > 0 && left(c, a) > 0) << "a hole's middle is covered";
                    }
                }
            }
        }
}

// A random simple polygon: points around a middle in order of their angle, on few places, so that many lie in one line.
TEST(Polygon, RandomOnesFarFromTheOrigin)
{
    std::mt19937 random(1);
    for (int round = 0; round < 300; ++round) {
        std::uniform_int_distribution<int> steps(0, 1 << 10), sizes(4, 60);
        Ring ring;
        const int size = sizes(random);
        for (int i = 0; i < size; ++i) {
            const double angle = 2 * std::numbers::pi * i / size, r = 1 + steps(random) % 8;
            ring.emplace_back(4.0e6 + std::round(1024 * r * std::cos(angle)) / 1024, 5.0e6 + std::round(1024 * r * std::sin(angle)) / 1024,
                              0);
        }
        const Triangles triangles = triangulated(ring);
        ASSERT_EQ(triangles.size(), ring.size() - 2);
        for (const auto& triangle : triangles) ASSERT_GE(area({triangle}, ring), 0) << "round " << round;
        ASSERT_NEAR(area(triangles, ring), area(ring), 1e-9) << "round " << round;
    }
}

TEST(Polygon, WhatCrossesItselfOrHasNoAreaIsDropped)
{
    for (const Ring& ring :
         {Ring{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}, Ring{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, Ring(9, Vec3(1, 2, 3))})
        EXPECT_EQ(triangulated(ring).size(), ring.size() - 2);
}
