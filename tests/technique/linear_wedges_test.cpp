// Paper I's linear wedges: ramps in closed form, continuity, corners against rays, and what must not change the mask.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include <penumbra/metrics.hpp>

#include "support/device_run.hpp"
#include "support/maps.hpp"
#include "technique/linear_wedges.hpp"
#include "technique/soft_shadow_volume.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

SphereLight sphere(double radius, const Vec3& center = {0, 0, 0})
{
    return {.center = center, .radius = radius, .direction = {0, 0, -1}, .up = Vec3(0, 1, 0)};
}

Object caster(TriangleMesh mesh) { return {.name = "caster", .mesh = std::move(mesh), .casts = true, .receives = false}; }

// A planar polygon, as a fan around its first vertex.
TriangleMesh polygon(const std::vector<Imath::V3f>& corners)
{
    TriangleMesh mesh{.positions = corners, .triangles = {}};
    for (std::uint32_t i = 2; i < corners.size(); ++i) mesh.triangles.push_back({0, i - 1, i});
    return mesh;
}

TriangleMesh box(const Imath::V3f& low, const Imath::V3f& high)
{
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) mesh.positions.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

const SoftShadowVolume linear{.coverage = Coverage::linear};

// A camera at the origin that looks along -Z, at a plane of one depth.
Receivers floor_of(int width, int height, float depth, const Vec2& tangents)
{
    return receivers(PinholeCamera{.frame = {}, .tan_half_fov = tangents}, flat(width, height, depth));
}

Mask shade(const Light& light, const TriangleMesh& mesh, const Receivers& r, const Technique& technique)
{
    return engine().shade(engine().prepare(light, Occluders{}, Geometry({caster(mesh)}), technique), r);
}

bool warned(const Mask& mask, const std::string& part)
{
    return std::any_of(mask.report.warnings.begin(), mask.report.warnings.end(), [&](const std::string& w) { return holds(w, part); });
}

// Everything left of x = 0, at depth 4; its other borders are further from the receivers than any penumbra. The edge's neighbours lie in
// line with it, so that its side directions are its normal: only then is Eq. 3 the same as Eq. 1.
TriangleMesh half_plane() { return polygon({{-100, -100, -4}, {0, -100, -4}, {0, -3, -4}, {0, 3, -4}, {0, 100, -4}, {-100, 100, -4}}); }

// The largest step between neighbouring pixels, along rows and columns.
double largest_step(const Image& image)
{
    double step = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            if (x > 0) step = std::max(step, std::abs(double{image.at(x, y)} - image.at(x - 1, y)));
            if (y > 0) step = std::max(step, std::abs(double{image.at(x, y)} - image.at(x, y - 1)));
        }
    return step;
}

// Eq. 1: s runs linearly over 2 r (z_p - z_o) / z_o, which grows linearly with the distance to the edge. And s' = 3 s^2 - 2 s^3.
TEST(LinearWedges, StraightEdgesHaveLinearRamps)
{
    constexpr int width = 93;
    const double radius = 0.5, z_o = 4;
    for (const float z_p : {4.5f, 8.0f, 12.0f, 16.0f}) {
        const double half = radius * (z_p - z_o) / z_o, tangent = 1.5 * half / z_p;
        const Receivers r = floor_of(width, 3, z_p, {tangent, 0.01});
        const Mask ramp = shade(sphere(radius), half_plane(), r, linear);
        SoftShadowVolume settings = linear;
        settings.smooth = true;
        const Mask smooth = shade(sphere(radius), half_plane(), r, settings);
        // In radii: s = (u_o - d + t) / (2 (u_o - d)). Fewer than 16 roundings of t, of u_o and of d, over the width of the ramp.
        const double u_o = radius / z_o, d = radius / z_p;
        const double bound = 16 * 0x1p-24 * (tangent + u_o + d) / (2 * (u_o - d)) + 4 * 0x1p-24;
        int penumbra = 0;
        for (int x = 0; x < width; ++x) {
            const double s = std::clamp(0.5 + ((2 * x + 1.0) / width - 1) * 1.5 / 2, 0.0, 1.0);
            penumbra += s > 0 && s < 1;
            EXPECT_NEAR(ramp.visibility.at(x, 1), s, bound) << z_p << ": " << x;
            // The cubic's slope is at most 3/2.
            EXPECT_NEAR(smooth.visibility.at(x, 1), s * s * (3 - 2 * s), 1.5 * bound + 4 * 0x1p-24) << z_p << ": " << x;
        }
        EXPECT_EQ(penumbra, 61) << z_p; // 31 / 46.5 of the row on either side of the middle, exclusive
    }
}

// A step stays a step however dense the samples; a continuous function's shrink. Around corners of all kinds (and their side planes),
// tilted, seen from aside.
TEST(LinearWedges, NeighboursAreContinuous)
{
    struct Case {
        const char* what;
        TriangleMesh mesh;
        int corner_wedges;
    };
    const std::vector<Case> cases{
        {"right", polygon({{0, 0, -4}, {0, -3, -4}, {3, -3, -4}, {3, 0, -4}}), 0},
        {"obtuse, tilted", polygon({{0, 0, -4}, {-1, -3, -3.5f}, {3, -3, -5}, {2, 1, -5.5f}}), 0},
        {"acute", polygon({{0, 0, -4}, {2, -3, -4}, {3, -2, -4}}), 0},
        {"acute, six wedges", polygon({{0, 0, -4}, {2, -3, -4}, {3, -2, -4}}), 6},
        {"acute, tilted, one wedge", polygon({{0, 0, -4}, {2, -3, -3}, {3, -2, -5}}), 1},
        {"needle, sixteen wedges", polygon({{0, 0, -4}, {3, -3, -4}, {3, -2.8f, -4}}), 16},
    };
    const double tangent = 0.25;
    for (const Case& c : cases) {
        SoftShadowVolume settings = linear;
        settings.corner_wedges = c.corner_wedges;
        const auto step = [&](int size) {
            return largest_step(
                shade(sphere(0.5, {0.7, -0.4, 0}), c.mesh, floor_of(size, size, 8, {tangent, tangent}), settings).visibility);
        };
        const double coarse = step(61), fine = step(8 * 61);
        EXPECT_GT(coarse, 0.01) << c.what;
        EXPECT_LT(fine, coarse / 3) << c.what;
    }
}

// Below the light's centre the diagonals' side planes hold the very rays of the receivers on them: each is in one wedge.
TEST(LinearWedges, RaysInSidePlanesAreInOneWedge)
{
    const TriangleMesh square = polygon({{-1, -1, -4}, {1, -1, -4}, {1, 1, -4}, {-1, 1, -4}});
    const Mask mask = shade(sphere(0.5), square, floor_of(64, 64, 8, {0.5, 0.5}), linear);
    for (int i = 0; i < 64; ++i) {
        // Along the diagonal the nearer side counts, as beside it: a pixel further in is never lighter.
        if (i > 0 && i < 32) {
            EXPECT_LE(mask.visibility.at(i, i), mask.visibility.at(i - 1, i - 1)) << i;
        }
        // Mirrored receivers differ by rounding only.
        EXPECT_NEAR(mask.visibility.at(i, i), mask.visibility.at(63 - i, i), 0x1p-18) << i;
        EXPECT_NEAR(mask.visibility.at(i, i), mask.visibility.at(i, 63 - i), 0x1p-18) << i;
    }
    EXPECT_EQ(mask.visibility.at(0, 0), 1.0f);
    EXPECT_EQ(mask.visibility.at(32, 32), 0.0f);
}

double error_against_rays(const Light& light, const TriangleMesh& mesh, const SoftShadowVolume& settings)
{
    const Receivers r = floor_of(128, 128, 8, {0.5, 0.5});
    return compare(shade(light, mesh, r, settings).visibility, shade(light, mesh, r, RayTraced{.samples = 1024}).visibility).mae_shadow;
}

// Linear instead of the circle's ramp: at most .056 off across an edge (mean .036 for the ramp alone); corners are worse. Limits are what
// was measured, a quarter more.
TEST(LinearWedges, ErrorsAgainstRays)
{
    const TriangleMesh square = polygon({{-1, -1, -4}, {1, -1, -4}, {1, 1, -4}, {-1, 1, -4}});
    const TriangleMesh needle = polygon({{-1.5f, -0.26f, -4}, {1.5f, 0, -4}, {-1.5f, 0.26f, -4}}); // 20 degrees
    const auto with = [](int corner_wedges, bool smooth) {
        SoftShadowVolume settings = linear;
        settings.corner_wedges = corner_wedges;
        settings.smooth = smooth;
        return settings;
    };
    const double right = error_against_rays(sphere(0.3), square, with(0, false)),
                 right_smooth = error_against_rays(sphere(0.3), square, with(0, true));
    const double acute = error_against_rays(sphere(0.3), needle, with(0, false)),
                 six = error_against_rays(sphere(0.3), needle, with(6, false)),
                 smooth = error_against_rays(sphere(0.3), needle, with(6, true));
    std::printf("mae_shadow: square %.4f, smooth %.4f; 20 degrees %.4f, six corner wedges %.4f, smooth %.4f\n", right, right_smooth, acute,
                six, smooth);
    EXPECT_LT(right_smooth, right);
    EXPECT_LT(six, acute);
    EXPECT_LT(smooth, six);
    EXPECT_LT(right, 0.03);
    EXPECT_LT(acute, 0.08);
}

// Eqs. 2 and 3 by hand, in radii: below a square of half side h at depth z, a receiver of tangents (t, t) and disparity d sees s of one
// side, next to that side's plane. n is the hard quad's normal, m . x = 1 on the edge and along n; the side direction is the sum of two
// neighbours' normals.
double light_below_square(double h, double z, double t, double d)
{
    const double rho = std::hypot(h, z), sine = h / rho, cosine = z / rho;
    const double middle = (sine * t + cosine) / rho, side = cosine * t - sine;
    const double back = std::max(0.0, middle + side - d), front = middle - side - d;
    const double n_l = 1 + sine * sine, m_l = -sine * cosine / rho;
    const double t_b = back / (n_l + m_l), t_f = front / (n_l - m_l);
    return t_b / (t_f + t_b);
}

TEST(LinearWedges, LargeLightsLeaveNoUmbra)
{
    const auto square = [](float h) { return polygon({{-h, -h, -4}, {h, -h, -4}, {h, h, -4}, {-h, h, -4}}); };
    double before = -1;
    for (const double radius : {0.5, 1.5, 2.0, 3.0}) {
        // The pixel beside the axis. (On the axis itself all side planes meet.)
        const double centre = shade(sphere(radius), square(1), floor_of(60, 60, 8, {1, 1}), linear).visibility.at(30, 30);
        EXPECT_NEAR(centre, light_below_square(1 / radius, 4 / radius, 1.0 / 60, radius / 8), 0x1p-18) << radius;
        EXPECT_GE(centre, before);
        before = centre;
    }
    EXPECT_GT(before, 0.2);
    // N.B. It never gets lighter than about 1/2, however small the square: Paper I's ramps do not know of the other side.
    const Receivers r = floor_of(60, 60, 8, {0.01, 0.01});
    const double small = shade(sphere(1), square(0.0625), r, linear).visibility.at(30, 30);
    EXPECT_NEAR(small, light_below_square(0.0625, 4, 0.01 / 60, 0.125), 0x1p-18);
    EXPECT_LT(small, 0.5);
    EXPECT_GT(shade(sphere(1), square(0.0625), r, RayTraced{.samples = 1024}).visibility.at(30, 30), 0.97f); // 1 - (1 / 4)^2 / pi
}

TEST(LinearWedges, LightsWithoutExtentCastHardShadows)
{
    const TriangleMesh mesh = box({-1, -1, -5}, {1, 1, -4});
    const Receivers r = floor_of(61, 61, 8, {0.5, 0.5});
    const Mask hard = shade(sphere(0), mesh, r, SoftShadowVolume{});
    EXPECT_EQ(shade(sphere(0), mesh, r, linear).visibility.pixels, hard.visibility.pixels);
    // Towards 0 it goes to the same, off the shadow's border.
    const Mask small = shade(sphere(1e-6), mesh, r, linear);
    int different = 0;
    for (std::size_t i = 0; i < hard.visibility.pixels.size(); ++i) different += small.visibility.pixels[i] != hard.visibility.pixels[i];
    EXPECT_EQ(different, 0);
    EXPECT_EQ(hard.visibility.at(30, 30), 0.0f);
    EXPECT_EQ(hard.visibility.at(0, 0), 1.0f);
}

// A box, a needle and a fan of triangles that fold back.
TriangleMesh bits_and_pieces()
{
    TriangleMesh mesh = box({-1, -1, -5}, {0.3f, 1, -3});
    const auto add = [&](const TriangleMesh& more) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
        for (const auto& t : more.triangles) mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    };
    add(polygon({{0.5f, -1, -4}, {0.6f, 2, -4.5f}, {0.45f, -1, -3}}));
    add(polygon({{1, 1, -3}, {1.5f, 0, -6}, {1, -1, -3}, {0.7f, 0.1f, -4}}));
    return mesh;
}

TEST(LinearWedges, CullingSparesNothingThatCounts)
{
    for (const Light& light : {Light(sphere(0.4, {0.5, 0.2, 0})), Light(rectangle_light(0.5, 0.1)), Light(sphere(5))})
        for (const int corner_wedges : {0, 6}) {
            std::vector<std::vector<float>> masks;
            std::vector<std::uint64_t> pairs;
            for (const WedgeCulling culling : {WedgeCulling::none, WedgeCulling::loose, WedgeCulling::far_depth, WedgeCulling::tight}) {
                SoftShadowVolume settings = linear;
                settings.culling = culling;
                settings.corner_wedges = corner_wedges;
                // Receivers from before the casters to far behind, in tiles of their own and mixed.
                const DepthMap depth = map_of(93, 61, [](int x, int y) {
                    return x < 50 ? 2.5f + 0.1f * static_cast<float>(x) : 6 + static_cast<float>((x * y) % 17);
                });
                const Mask mask =
                    shade(light, bits_and_pieces(), receivers(PinholeCamera{.frame = {}, .tan_half_fov = {0.8, 0.6}}, depth), settings);
                masks.push_back(mask.visibility.pixels);
                pairs.push_back(mask.report.pairs);
            }
            for (const auto& mask : masks) EXPECT_EQ(hash_of(mask), hash_of(masks[0]));
            EXPECT_LT(pairs[3], pairs[0]);
            EXPECT_LT(*std::min_element(masks[0].begin(), masks[0].end()), 0.5f);
            EXPECT_GT(*std::max_element(masks[0].begin(), masks[0].end()), 0.5f);
        }
}

// The wedges of a sharp corner run far beyond the true penumbra: 1 / sin(10 degrees) radii here, over several tiles.
TEST(LinearWedges, CullingKnowsHowFarCornersReach)
{
    const TriangleMesh needle = polygon({{-1.5f, -0.26f, -4}, {1.5f, 0, -4}, {-1.5f, 0.26f, -4}});
    const auto mask_of = [&](WedgeCulling culling) {
        SoftShadowVolume settings = linear;
        settings.culling = culling;
        return shade(sphere(0.5), needle, floor_of(256, 64, 8, {0.8, 0.2}), settings);
    };
    const Mask all = mask_of(WedgeCulling::none), culled = mask_of(WedgeCulling::tight);
    EXPECT_EQ(hash_of(culled.visibility.pixels), hash_of(all.visibility.pixels));
    // Beyond the tip (tangent 3 / 8) by thrice the penumbra's 1 / 16.
    const int x = static_cast<int>((1 + (3.0 / 8 + 3.0 / 16) / 0.8) * 128);
    EXPECT_LT(all.visibility.at(x, 32), 1.0f);
    EXPECT_LT(culled.report.pairs, all.report.pairs);
}

TEST(LinearWedges, LanesGiveTheSameBits)
{
    const auto context = device_context(true);
    const Light light = sphere(0.4, {0.5, 0.2, 0});
    const TriangleMesh mesh = bits_and_pieces();
    const TriangleMesh* const meshes[] = {&mesh};
    const Topology topology(meshes);
    SoftShadowVolume settings = linear;
    settings.corner_wedges = 6;
    settings.smooth = true;
    std::vector<std::vector<float>> masks;
    for (const int lanes : {1, 8, 16}) {
        context->quirks().lanes = lanes;
        opencl::Work work(context);
        const PreparedSoftShadowVolume prepared = prepare_soft_shadow_volume(work, light, {.topology = topology}, settings);
        const DepthMap depth = random_map(61, 47, 4, 12, 0.1, 9);
        const auto uploaded = work.upload(std::span<const float>(depth.depth), "receivers");
        const Camera camera{.frame = {}, .orthographic = false, .half_extent = {0.8, 0.6}};
        const ReceiverPoints points =
            receiver_points(work, receiver_view(camera, 61, 47, wedge_view(light)), uploaded.memory(), depth.precision);
        const auto visibility = work.buffer<float>(depth.depth.size(), "visibility");
        shade_soft_shadow_volume(work, prepared, points, visibility.memory(), nullptr);
        masks.push_back(work.read(visibility));
        work.finish();
    }
    EXPECT_EQ(hash_of(masks[0]), hash_of(masks[2]));
    EXPECT_EQ(hash_of(masks[1]), hash_of(masks[2]));
    EXPECT_LT(*std::min_element(masks[0].begin(), masks[0].end()), 0.5f);
    EXPECT_GT(*std::max_element(masks[0].begin(), masks[0].end()), 0.5f);
}

// Edges that point at the light's centre have no wedge; corners that fold back share no plane. Masks stay masks, and the report says so.
TEST(LinearWedges, DegenerateEdgesAreSaid)
{
    const Receivers r = floor_of(61, 61, 8, {0.5, 0.5});
    const auto in_range = [](const Mask& mask) {
        return std::all_of(mask.visibility.pixels.begin(), mask.visibility.pixels.end(), [](float v) { return v >= 0 && v <= 1; });
    };
    // A side all but in line with the light's centre. (In line, its triangle does not face it.)
    const Mask pointing =
        shade(sphere(0.5), polygon({{1, 0, -4}, {std::nextafter(1.5f, 2.0f), 0, -6}, {0.5f, 1, -4}, {-1, 0, -4}}), r, linear);
    EXPECT_TRUE(warned(pointing, "1 of 4 silhouette edges point at the light's centre"))
        << (pointing.report.warnings.empty() ? "" : pointing.report.warnings.back());
    EXPECT_TRUE(in_range(pointing));
    EXPECT_LT(*std::min_element(pointing.visibility.pixels.begin(), pointing.visibility.pixels.end()), 1.0f);
    // A sliver of 2^-8 rad.
    const Mask sliver = shade(sphere(0.5), polygon({{-1, -1, -4}, {1, 1, -4}, {1, 1.011f, -4}}), r, linear);
    EXPECT_TRUE(warned(sliver, "share no side plane"));
    EXPECT_TRUE(in_range(sliver));
    // Vertices at the light, behind it, and all over it.
    for (const Imath::V3f& corner : {Imath::V3f(0, 0, 0), Imath::V3f(0, 0, 1), Imath::V3f(1e6f, 0, -1e-6f), Imath::V3f(0, 0, -0.1f)})
        EXPECT_TRUE(in_range(shade(sphere(0.5), polygon({{1, 0, -4}, corner, {-1, 1, -4}}), r, linear))) << corner.x << " " << corner.z;
}

TEST(LinearWedges, RectanglesCountAsTheSphereAround)
{
    const TriangleMesh mesh = box({-1, -1, -5}, {1, 1, -4});
    const Receivers r = floor_of(61, 61, 8, {0.5, 0.5});
    const Mask rectangle = shade(rectangle_light(0.4, 0.3), mesh, r, linear), round = shade(sphere(0.5), mesh, r, linear);
    // Alike but for the rounding of tangents that are counted in other units: 16 roundings over a ramp of 2 (r / 5 - r / 8).
    for (std::size_t i = 0; i < round.visibility.pixels.size(); ++i)
        EXPECT_NEAR(rectangle.visibility.pixels[i], round.visibility.pixels[i], 64 * 0x1p-24 / 0.075);
    EXPECT_TRUE(warned(rectangle, "the sphere around it"));
    EXPECT_FALSE(warned(round, "the sphere around it"));
}

// Fig. 7's wedges: none at right angles, all at 0 degrees, in proportion between.
TEST(LinearWedges, CornerWedgesGoByTheAngle)
{
    const LightFrame light = light_frame(sphere(0.5));
    const auto count = [&](const TriangleMesh& mesh, int most) {
        const TriangleMesh* const meshes[] = {&mesh};
        const Topology topology(meshes);
        const LightPart part = light_parts(light, 1).front();
        return linear_wedges(topology, silhouette_of(topology, light.origin), light, part, false, most).corner_wedges;
    };
    EXPECT_EQ(count(polygon({{-1, -1, -4}, {1, -1, -4}, {1, 1, -4}, {-1, 1, -4}}), 16), 0u);
    // 60 degrees three times, below the light's centre: ceil(6 / 3) each, seen from there a little more or less.
    const float h = std::sqrt(3.0f);
    EXPECT_EQ(count(polygon({{-100, -h * 100 / 3, -4e4f}, {100, -h * 100 / 3, -4e4f}, {0, h * 200 / 3, -4e4f}}), 5), 6u);
    EXPECT_EQ(count(polygon({{-1, -1, -4}, {1, -1, -4}, {0, 1, -4}}), 0), 0u);
    // Nearly 0 degrees at one corner, a right angle and nearly that at the others.
    EXPECT_EQ(count(polygon({{-1, 0, -4}, {1, 0, -4}, {1, 0.001f, -4}}), 16), 17u);
}

} // namespace
} // namespace penumbra::test
