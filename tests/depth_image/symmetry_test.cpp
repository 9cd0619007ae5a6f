// Mirrored and turned images have mirrored and turned planes.
#include "depth_image/images.hpp"

#include "depth_image/thickness.hpp"

namespace penumbra::test {
namespace {

constexpr int size = 48;

// Where pixel (x, y) of the changed image comes from, and what becomes of a slope.
struct Change {
    const char* name;
    int xx, xy, yx, yy; // about the image's middle
    std::size_t source(int x, int y) const
    {
        const int px = 2 * x + 1 - size, py = 2 * y + 1 - size;
        return static_cast<std::size_t>((yx * px + yy * py + size - 1) / 2) * size +
               static_cast<std::size_t>((xx * px + xy * py + size - 1) / 2);
    }
};
const std::vector<Change> changes = {
    {"left and right", -1, 0, 0, 1}, {"top and bottom", 1, 0, 0, -1}, {"a quarter turn", 0, 1, -1, 0}, {"half a turn", -1, 0, 0, -1}};

DepthMap changed(const DepthMap& map, const Change& change)
{
    DepthMap result = map;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) result.at(x, y) = map.depth[change.source(x, y)];
    return result;
}

// A ball, a crease and a step at once, with a hole.
double scene(double x, double y)
{
    if (std::hypot(x + 15, y - 14) < 5) return 0;
    const Ball ball{{.2, 1e-3, 5e-4}, 1.2 / size, 3, .7};
    return x > 6 && y < -4 ? std::min(.5 + 2e-3 * x - 1e-3 * y, .53 - 1e-3 * x) : ball(x - .3, y + .7);
}

// Float32's sums depend on the order that pixels come in, and the first slopes and windows on ties: pixels whose decisions are close may
// take another plane. All but 2 % agree: values to the rounding of a window's sums (fit_test.cpp has the bounds), 2e-6.
void expect_same_fit(const DepthFit& before, const DepthFit& after, const Change& change)
{
    int differing = 0;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const std::size_t i = after.index(x, y), j = change.source(x, y);
            EXPECT_EQ(after.there[i], before.there[j]) << x << ", " << y;
            EXPECT_EQ(after.shaded[i], before.shaded[j]) << x << ", " << y;
            EXPECT_EQ(after.sigma[i], before.sigma[j]) << x << ", " << y;
            // The step along x of the changed image is that along (xx, yx) of the old one.
            const float sx = static_cast<float>(change.xx) * before.slope_x[j] + static_cast<float>(change.yx) * before.slope_y[j];
            const float sy = static_cast<float>(change.xy) * before.slope_x[j] + static_cast<float>(change.yy) * before.slope_y[j];
            differing += std::abs(after.value[i] - before.value[j]) > 2e-6f || std::abs(after.slope_x[i] - sx) > 2e-6f ||
                         std::abs(after.slope_y[i] - sy) > 2e-6f;
        }
    EXPECT_LE(differing, size * size / 50);
}

TEST(DepthSymmetry, OfFits)
{
    for (const double noise : {0., 1e-4}) {
        const DepthMap map = image_of(size, size, scene, {noise});
        const DepthFit before = fit_of(map);
        for (const Change& change : changes) {
            SCOPED_TRACE(testing::Message() << change.name << ", " << noise);
            const DepthFit after = fit_of(changed(map, change));
            // The median is of the same numbers, and a mirrored second difference is the same sum of two.
            EXPECT_EQ(after.quality.noise, before.quality.noise);
            EXPECT_EQ(after.quality.reach, before.quality.reach);
            expect_same_fit(before, after, change);
        }
    }
}

// Distances are exact, and so is everything that is made of them; given the same fit, changed by hand.
TEST(DepthSymmetry, OfThickness)
{
    const DepthFit before = fit_of(image_of(size, size, scene));
    const auto thick = thickness_of(before);
    for (const Change& change : changes) {
        SCOPED_TRACE(change.name);
        DepthFit after = before;
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const std::size_t i = after.index(x, y), j = change.source(x, y);
                after.value[i] = before.value[j], after.there[i] = before.there[j], after.mixed[i] = before.mixed[j],
                after.sigma[i] = before.sigma[j];
                after.slope_x[i] = static_cast<float>(change.xx) * before.slope_x[j] + static_cast<float>(change.yx) * before.slope_y[j];
                after.slope_y[i] = static_cast<float>(change.xy) * before.slope_x[j] + static_cast<float>(change.yy) * before.slope_y[j];
            }
        const auto found = thickness_of(after);
        // The membrane is solved to 1e-4 of the thickness it gives, from unknowns in another order.
        const float largest = *std::max_element(thick.begin(), thick.end());
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x)
                EXPECT_NEAR(found[after.index(x, y)], thick[change.source(x, y)], 2 * 2e-4 * largest) << x << ", " << y;
    }
}

TEST(DepthSymmetry, OfLocalThicknessIsExact)
{
    std::mt19937 random(4);
    std::vector<std::uint8_t> marked(size * size), turned(size * size);
    for (auto& mark : marked) mark = random() % 60 == 0;
    const auto thick = local_thickness(distance_to(marked, size, size), size, size);
    for (const Change& change : changes) {
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) turned[static_cast<std::size_t>(y * size + x)] = marked[change.source(x, y)];
        const auto found = local_thickness(distance_to(turned, size, size), size, size);
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) EXPECT_EQ(found[static_cast<std::size_t>(y * size + x)], thick[change.source(x, y)]);
    }
}

} // namespace
} // namespace penumbra::test
