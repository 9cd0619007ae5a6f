// Distances, local thickness, and membranes of depth images.
#include "depth_image/images.hpp"

#include "depth_image/edges.hpp"
#include "depth_image/thickness.hpp"

namespace penumbra::test {
namespace {

using Marks = std::vector<std::uint8_t>;

std::size_t index_of(int width, int x, int y)
{
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

void expect_distances(const Marks& marked, int width, int height)
{
    const auto found = distance_to(marked, width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            int best = INT32_MAX;
            for (int v = 0; v < height; ++v)
                for (int u = 0; u < width; ++u)
                    if (marked[index_of(width, u, v)]) best = std::min(best, (u - x) * (u - x) + (v - y) * (v - y));
            // Squares are whole numbers that float32 holds; the root is rounded once, as here.
            const float expected = best == INT32_MAX ? std::numeric_limits<float>::infinity() : std::sqrt(static_cast<float>(best));
            ASSERT_EQ(found[index_of(width, x, y)], expected) << x << ", " << y;
        }
}

TEST(DepthDistance, AgainstBruteForce)
{
    std::mt19937 random(3);
    for (const auto& [width, height] : {std::pair{61, 37}, {93, 7}, {1, 50}, {50, 1}, {1, 1}})
        for (const unsigned one_in : {2u, 10u, 200u}) {
            Marks marked(static_cast<std::size_t>(width * height));
            for (auto& mark : marked) mark = random() % one_in == 0;
            expect_distances(marked, width, height);
        }
}

TEST(DepthDistance, OfNothingMarked) { expect_distances(Marks(61 * 37), 61, 37); }

// Thickness inside a shape; pixels outside are the silhouette.
using Shape = std::function<bool(double x, double y)>;
std::vector<float> distance_in(const Shape& shape, int size)
{
    Marks outside(static_cast<std::size_t>(size * size));
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) outside[index_of(size, x, y)] = !shape(x + .5 - size / 2., y + .5 - size / 2.);
    return distance_to(outside, size, size);
}

// Radii are tried in steps of 6 % and half a pixel at least, so the widest that is found may be smaller by a step, and a pixel's own
// distance is exact. The shape itself is right to a pixel on either side: distances count to the centres of pixels outside, up to sqrt(2)
// beyond the border. Pixels of the border itself may stick out of every disc of pixels.
void expect_thickness(const Shape& shape, int size, double expected, const Shape& looked_at)
{
    const auto distance = distance_in(shape, size), found = local_thickness(distance, size, size);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const double px = x + .5 - size / 2., py = y + .5 - size / 2.;
            if (!shape(px, py) || !looked_at(px, py)) continue;
            EXPECT_LE(found[index_of(size, x, y)], expected + 1.5) << px << ", " << py;
            if (distance[index_of(size, x, y)] < 2) continue;
            EXPECT_GE(found[index_of(size, x, y)], expected / 1.06 - .5 - 1.5) << px << ", " << py;
        }
}

void expect_thickness(const Shape& shape, int size, double expected)
{
    expect_thickness(shape, size, expected, [](double, double) { return true; });
}

TEST(LocalThickness, OfADiscIsItsRadius)
{
    for (const double radius : {6.5, 20., 40.})
        expect_thickness([radius](double x, double y) { return std::hypot(x, y) < radius; }, 101, radius);
}

TEST(LocalThickness, OfABarIsHalfItsWidth)
{
    // Its ends lie outside the image.
    for (const double half : {3., 8., 25.}) {
        expect_thickness([half](double x, double) { return std::abs(x) < half; }, 101, half);
        expect_thickness([half](double, double y) { return std::abs(y) < half; }, 101, half);
    }
    // Aslant; away from the image's corners, where the bar ends.
    expect_thickness([](double x, double y) { return std::abs(x + y) < 10 * std::sqrt(2.); }, 101, 10,
                     [](double x, double y) { return std::abs(x - y) < 50; });
}

TEST(LocalThickness, OfARingIsHalfItsWidth)
{
    expect_thickness([](double x, double y) { return std::abs(std::hypot(x, y) - 32) < 8; }, 101, 8);
}

// --- Membranes
// ------------------------------------------------------------------------------------------------------------------------------

// A plate, tilted, before a wall: its membrane is the plate.
TEST(Membrane, OfAPlaneIsThePlane)
{
    const Plane plate{.5, 1e-3, -6e-4}, wall{.2, 1e-4, 0};
    const DepthFit fit =
        fit_of(image_of(121, 91, [&](double x, double y) { return std::abs(x) < 40 && std::abs(y) < 30 ? plate(x, y) : wall(x, y); }));
    const auto span = membrane(fit, silhouettes(fit));
    for (int y = 0; y < 91; ++y)
        for (int x = 0; x < 121; ++x) {
            const double px = x + .5 - 60.5, py = y + .5 - 45.5;
            if (std::abs(px) >= 40 || std::abs(py) >= 30) continue;
            // What is left of the right hand side are roundings of the values, up to 9 (plane_test.cpp) at each of four neighbours; a
            // membrane sums them up with Green's function, whose sum of squares over a plate of n pixels' half width is about n^2 / 10.
            EXPECT_NEAR(span[fit.index(x, y)], fit.value[fit.index(x, y)], 36 * rounding * .6 * 30 / std::sqrt(10.));
        }
}

TEST(Membrane, APlateThatFacesTheCameraIsThin)
{
    const DepthFit fit = fit_of(image_of(121, 91, [](double x, double y) { return std::abs(x) < 40 && std::abs(y) < 30 ? .5 : .2; }));
    const auto thickness = thickness_of(fit);
    const double footprint = 2 * fit.pixel_y;
    for (int y = 0; y < 91; ++y)
        for (int x = 0; x < 121; ++x) {
            if (std::abs(x + .5 - 60.5) >= 40 || std::abs(y + .5 - 45.5) >= 30) continue;
            // .2 of a round body of 30 pixels' radius and a step of 6 % at the most, and half a pixel.
            EXPECT_LE(thickness[fit.index(x, y)], footprint * (.2 * 2 * 31.8 + .5 + .01));
            EXPECT_GT(thickness[fit.index(x, y)], 0);
        }
}

// Independent of how it was solved: at free pixels the sum of differences to the joined neighbours is the tiny hold alone.
TEST(Membrane, SolvesLaplacesEquation)
{
    const Ball ball{{.2, 1e-4, 2e-4}, 1.2 / 121, 3, .9};
    const DepthFit fit = fit_of(image_of(121, 91, ball));
    const Marks edge = silhouettes(fit);
    const auto span = membrane(fit, edge);
    double rest = 0, right = 0;
    const auto joined = [&](std::size_t i, std::size_t j) {
        return fit.there[j] && std::abs(fit.value[j] - fit.value[i]) <= std::max(fit.joint(i), fit.joint(j));
    };
    for (int y = 0; y < 91; ++y)
        for (int x = 0; x < 121; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!fit.there[i] || edge[i]) continue;
            double of_span = 0, of_value = 0;
            for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
                if (x + dx < 0 || x + dx >= 121 || y + dy < 0 || y + dy >= 91 || !joined(i, fit.index(x + dx, y + dy))) continue;
                const std::size_t j = fit.index(x + dx, y + dy);
                of_span += static_cast<double>(span[j]) - static_cast<double>(span[i]);
                of_value += static_cast<double>(fit.value[j]) - static_cast<double>(fit.value[i]);
            }
            rest += of_span * of_span;
            right += of_value * of_value;
        }
    // Solved until the residual is 1e-5 of the right hand side; four differences of float32 values besides, in 121 x 91 equations.
    EXPECT_LE(std::sqrt(rest), 2e-5 * std::sqrt(right) + std::sqrt(121 * 91.) * 4 * rounding * .5);
    EXPECT_GT(right, 0);
}

// A ball closes as it opened: twice the way to the silhouette's plane is the ball's own thickness, but for the part of it that the camera
// sees short of the equator and for the pixel that the silhouette lies inside.
TEST(Membrane, OfABallMirrorsIt)
{
    const Ball ball{{.1, 0, 0}, 1.2 / 241, 10, 3};
    const DepthFit fit = fit_of(image_of(241, 181, ball));
    const auto span = membrane(fit, silhouettes(fit));
    // The circle of tangency lies r^2 / z nearer than the centre; in the middle the way to its plane is r - r^2 / z.
    const double expected = 2 * (3 - 9. / 10);
    const std::size_t middle = fit.index(120, 90);
    const double found = 2 * (1 / static_cast<double>(span[middle]) - static_cast<double>(fit.depth(middle)));
    // Of the circle's radius of n = 63 pixels the silhouette's centres lie up to one inside: by r sqrt(2 / n) before the circle's plane.
    EXPECT_LE(found, expected * 1.02);
    EXPECT_GE(found, expected - 2 * 3 * std::sqrt(2 / 63.));
}

// From afar, where a body of revolution and the ball are one: the silhouette's line may be off by a pixel of 63, radii are tried in steps
// of 6 %, and the front, where the footprint is taken, is 3 % nearer than the middle.
TEST(Thickness, OfABallIsItsDiameter)
{
    const double pixel = .03 / 63;
    const DepthMap map = image_of(241, 181, Ball{{.005, 0, 0}, pixel, 100, 3});
    const DepthFit fit = fit_of(map, camera_for(241, 181, 241 * pixel / 2));
    EXPECT_NEAR(thickness_of(fit)[fit.index(120, 90)], 6, 6 * (1 / 63. + .06 + .03));
}

} // namespace
} // namespace penumbra::test
