// Depth as other programs hand it over, as receivers before the true meshes and as all there is: a short run of bench/depth.py's table.
#include <algorithm>
#include <numbers>

#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

constexpr int width = 320, height = 180, fine = 4;

// --- A ball, a turned block and a post on a floor ----------------------------------------------------------------------------------

Object ball(const Vec3& center, double radius)
{
    constexpr int rings = 24, around = 48;
    Object object{.name = "ball", .mesh = {}};
    for (int i = 0; i <= rings; ++i)
        for (int k = 0; k < around; ++k) {
            const double polar = std::numbers::pi * i / rings, turn = 2 * std::numbers::pi * k / around;
            object.mesh.positions.emplace_back(center + Vec3(std::sin(polar) * std::cos(turn), -std::cos(polar), std::sin(polar) * std::sin(turn)) * radius);
        }
    for (unsigned i = 0; i < rings; ++i)
        for (unsigned k = 0; k < around; ++k) {
            const unsigned a = i * around + k, b = i * around + (k + 1) % around;
            if (i > 0) object.mesh.triangles.push_back({a, a + around, b});
            if (i + 1 < rings) object.mesh.triangles.push_back({b, a + around, b + around});
        }
    return object;
}

Object block(const Vec3& center, const Vec3& half, double degrees)
{
    const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
    Object object{.name = "block", .mesh = {}};
    for (int i = 0; i < 8; ++i) {
        const Vec3 p((i & 4 ? 1 : -1) * half.x, (i & 2 ? 1 : -1) * half.y, (i & 1 ? 1 : -1) * half.z);
        object.mesh.positions.emplace_back(center + Vec3(c * p.x + s * p.z, p.y, -s * p.x + c * p.z));
    }
    for (const auto& [a, b, d, e] : {std::array<unsigned, 4>{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}) {
        object.mesh.triangles.push_back({a, b, d});
        object.mesh.triangles.push_back({a, d, e});
    }
    return object;
}

Object floor_of(double half)
{
    Object object{.name = "floor", .mesh = {}};
    for (const auto& [x, z] : {std::pair{-half, half}, {half, half}, {half, -half}, {-half, -half}}) object.mesh.positions.emplace_back(Vec3(x, 0, z));
    object.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return object;
}

Frame looking(const Vec3& eye, const Vec3& target)
{
    const Vec3 back = (eye - target).normalized(), right = Vec3(0, 1, 0).cross(back).normalized();
    return {.origin = eye, .x = right, .y = back.cross(right), .z = back};
}

const PinholeCamera camera{.frame = looking({-2.4, 3.2, 5}, {0, .4, 0}), .tan_half_fov = {.36 * width / height, .36}};
const Camera seen_from{.frame = camera.frame, .orthographic = false, .half_extent = camera.tan_half_fov};

Scene scene()
{
    // The light shines along (-.4, -1, -.3).
    const Vec3 along = Vec3(-.4, -1, -.3).normalized(), u = along.cross(Vec3(0, 0, 1)).normalized(), v = along.cross(u);
    return {.light = RectangleLight{.center = {2.2, 5, 2}, .half_u = u * .4, .half_v = v * -.4, .emission = {}},
            .objects = {ball({-.7, .55, .6}, .55), block({.8, .4, .3}, {.4, .4, .3}, 32), block({0, .7, -.9}, {.06, .7, .06}, 0), floor_of(14)},
            .occluders = {.camera = LightCamera{}, .width = 512, .height = 512, .front = {}, .back = {}, .layers = {}},
            .receivers = {.camera = camera, .width = width, .height = height, .depth = {}, .surface = {}},
            .technique = {},
            .output = {},
            .warnings = {}};
}

// Rendered by penumbra: exact.
DepthMap rendered(int times)
{
    Receivers receivers = scene().receivers;
    receivers.width *= times;
    receivers.height *= times;
    return *with_depth(receivers, scene().light, Geometry(scene().objects)).depth;
}

// --- The same depth as other programs hand it over -----------------------------------------------------------------------------------

DepthMap foreign(DepthMap map)
{
    map.from_image = true;
    return map;
}

DepthMap scaled(float factor)
{
    DepthMap map = rendered(1);
    for (float& z : map.depth) z *= factor;
    return foreign(map);
}

DepthMap noisy(float share)
{
    DepthMap map = rendered(1);
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    for (float& z : map.depth) z *= 1 + share * normal(random);
    return foreign(map);
}

// Each pixel from its block of finer depth.
template <class Of> DepthMap from_blocks(const Of& of)
{
    static const DepthMap finer = rendered(fine);
    DepthMap map = rendered(1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) map.at(x, y) = of(finer, x * fine, y * fine);
    return foreign(map);
}

DepthMap anti_aliased()
{
    return from_blocks([](const DepthMap& finer, int x, int y) {
        float sum = 0;
        for (int j = 0; j < fine; ++j)
            for (int i = 0; i < fine; ++i) sum += finer.at(x + i, y + j);
        return sum / (fine * fine);
    });
}

DepthMap jittered()
{
    std::mt19937 random(5);
    std::uniform_int_distribution<int> any(0, fine - 1);
    return from_blocks([&](const DepthMap& finer, int x, int y) {
        const int i = any(random), j = any(random);
        return finer.at(x + i, y + j);
    });
}

DepthMap half_float()
{
    DepthMap map = rendered(1);
    for (float& z : map.depth) {
        const float unit = std::ldexp(1.f, std::ilogb(z) - 10);
        z = std::round(z / unit) * unit;
    }
    map.step.mantissa_bits = 10;
    return foreign(map);
}

// --- The table -----------------------------------------------------------------------------------------------------------------------

struct Figures {
    double mean = 0;
    int isolated = 0;
};

bool stands_out(const Image& mask, int x, int y)
{
    std::vector<float> around;
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height - 1); ++j)
        for (int i = std::max(x - 1, 0); i <= std::min(x + 1, width - 1); ++i) around.push_back(mask.at(i, j));
    std::nth_element(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2), around.end());
    return std::abs(mask.at(x, y) - around[around.size() / 2]) > .35f;
}

// Over pixels whose depth is still their own surface's.
Figures figures_of(const Image& mask, const Image& truth, const DepthMap& depth)
{
    static const DepthMap own = rendered(1);
    double sum = 0, shadow = 0;
    int isolated = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (std::abs(depth.at(x, y) / own.at(x, y) - 1) > .06f) continue;
            isolated += stands_out(mask, x, y) && !stands_out(truth, x, y);
            if (std::min(mask.at(x, y), truth.at(x, y)) > .999f) continue;
            sum += std::abs(mask.at(x, y) - truth.at(x, y));
            ++shadow;
        }
    return {sum / shadow, isolated};
}

Image mask_of(const Scene& of, const Technique& technique) { return engine().mask(of, technique).visibility; }

const Image& truth()
{
    static const Image made = mask_of(scene(), RayTraced{.samples = 1024});
    return made;
}

struct Row {
    const char* name;
    DepthMap depth;
    // Of pixels as large as these (a ball is 50 wide); measured, and a tenth on top (as is the number of isolated pixels below: 62 at the most, of rays 51). `more`: beyond a technique's error on depth of our own.
    double more, relit;
};

const std::vector<Row>& rows()
{
    static const std::vector<Row> all = {{"x (1 + 4e-6)", scaled(1 + 4e-6f), .025, .037},
                                         {"half float", half_float(), .029, .039},
                                         {"anywhere in the pixel", jittered(), .083, .095},
                                         {"noise of 1e-3", noisy(1e-3f), .045, .055},
                                         {"anti-aliased", anti_aliased(), .035, .052}};
    return all;
}

void expect(const Scene& changed, const Technique& technique, const Row& row, double allowed)
{
    const Figures found = figures_of(mask_of(changed, technique), truth(), row.depth);
    std::printf("[  MEASURE ] %s, %s: mean %.4f, %d isolated\n", kind_of(technique).c_str(), row.name, found.mean, found.isolated);
    EXPECT_LE(found.mean, allowed) << kind_of(technique) << ", " << row.name;
    EXPECT_LE(found.isolated, 68) << kind_of(technique) << ", " << row.name;
}

TEST(ForeignDepth, OnReceiversBeforeTrueMeshes)
{
    for (const Technique& technique : {Technique(RayTraced{.samples = 64}), Technique(SoftShadowMap{}), Technique(OcclusionTexture{})}) {
        const double own = figures_of(mask_of(scene(), technique), truth(), rendered(1)).mean;
        for (const Row& row : rows()) {
            Scene changed = scene();
            changed.receivers.depth = row.depth;
            expect(changed, technique, row, own + row.more);
        }
    }
}

// The image alone, as caster and receiver. Maps of it cost a little more.
TEST(ForeignDepth, AsAllThereIs)
{
    for (const Row& row : rows()) {
        Scene changed = scene();
        changed.receivers.depth = row.depth;
        changed.objects = {Object{.name = "image", .mesh = {}, .seen = SeenSurface{.depth = row.depth, .camera = seen_from}}};
        expect(changed, DepthTrace{}, row, row.relit);
        expect(changed, SoftShadowMap{}, row, row.relit + .015);
    }
}

} // namespace
} // namespace penumbra::test
