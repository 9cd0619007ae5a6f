// Walks of lines through depth images: the pyramid changes no bit, and what blocks is what blocks pixel by pixel.
#include "depth_image/walk_images.hpp"

#include "oracle/depth_walk_oracle.hpp"

namespace penumbra::test {
namespace {

struct Case {
    int width, height;
    bool orthographic;
    double steep, holes;
};
// Blocks of 64 pixels and parts of them; 93 x 70 has more than one on the coarsest level.
const std::vector<Case> cases = {{93, 70, false, .004, 0},  {93, 70, false, .02, .3}, {61, 37, false, .004, .7}, {200, 9, false, .01, .1},
                                 {1, 130, false, .004, .1}, {93, 70, true, .004, .1}, {61, 37, true, .02, .5}};

// The same line with and without the pyramid.
bool same(const DepthImage& image, const DepthLine& line, int all, int through)
{
    const DepthMet with = walk(image, DEPTH_LEVELS, line, all, through), without = walk(image, 0, line, all, through);
    if (with.blocked != without.blocked) return false;
    if (through) return with.enter == without.enter && with.leave == without.leave;
    return !all || (with.crossed == without.crossed && with.behind == without.behind);
}

// Lines for which a walk differs.
template <class MakeLine> int differing(const Case& c, int lines, const MakeLine& make, int all, int through)
{
    int count = 0;
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
        const DepthImage image = random_image(c.width, c.height, c.orthographic, c.steep, c.holes, seed);
        WalkRandom random(seed + 100);
        for (int i = 0; i < lines; ++i) count += !same(image, make(random, image.view), all, through);
    }
    return count;
}

template <class MakeLine> void expect_same(const MakeLine& make)
{
    for (const Case& c : cases) {
        SCOPED_TRACE(testing::Message() << c.width << " x " << c.height << (c.orthographic ? ", orthographic" : "") << ", steep "
                                        << c.steep);
        EXPECT_EQ(differing(c, 20000, make, 0, 0), 0) << "blocked";
        EXPECT_EQ(differing(c, 20000, make, 1, 0), 0) << "all that is met";
        EXPECT_EQ(differing(c, 20000, make, 0, 1), 0) << "through";
    }
}

TEST(DepthWalk, ThePyramidChangesNoBitOfRandomLines) { expect_same(random_line); }
TEST(DepthWalk, ThePyramidChangesNoBitOfStraightLines) { expect_same(straight_line); }

// Surfaces so steep that an empty neighbour would be within their joint: nothing is joined to nothing.
TEST(DepthWalk, ThePyramidChangesNoBitBesideSteepSurfaces)
{
    const Case steep{93, 70, false, .3, .5};
    EXPECT_EQ(differing(steep, 50000, random_line, 0, 0), 0);
    EXPECT_EQ(differing(steep, 50000, random_line, 1, 0), 0);
    EXPECT_EQ(differing(steep, 50000, straight_line, 1, 0), 0);
}

// A line that ends inside the image has not left it, with the pyramid or without.
TEST(DepthWalk, LinesThatEndInsideTheImageHaveNotLeftIt)
{
    for (const Case& c : cases) {
        const DepthImage image = random_image(c.width, c.height, c.orthographic, c.steep, c.holes, 4);
        WalkRandom random(5);
        int left = 0, checked = 0;
        for (int i = 0; i < 300000; ++i) {
            const DepthLine line = random_line(random, image.view);
            const double x = line.x + static_cast<double>(line.to) * line.step_x, y = line.y + static_cast<double>(line.to) * line.step_y;
            // A tenth of a pixel off the border is far beyond rounding.
            const bool starts_inside = line.x >= 0 && line.y >= 0 && line.x < static_cast<float>(c.width) && line.y < static_cast<float>(c.height);
            if (!starts_inside || !(line.from < line.to) || !(std::min(x, y) > .1) || !(x < c.width - .1) || !(y < c.height - .1)) continue;
            ++checked;
            left += walk(image, 0, line, 1, 0).left + walk(image, DEPTH_LEVELS, line, 1, 0).left;
        }
        EXPECT_GT(checked, 100);
        EXPECT_EQ(left, 0) << c.width << " x " << c.height << ", of " << checked;
    }
}

// A line that comes from beside the image and stays behind what is seen has crossed no front.
TEST(DepthWalk, FromBesideTheImageBehindAFrontCrossesNothing)
{
    DepthFit fit = fit_of(flat(32, 32, 1));
    const DepthImage image = depth_image(fit, camera_for(32, 32), .1);
    for (const int levels : {0, DEPTH_LEVELS}) {
        const DepthLine line = depth_line(image.view, vector_of(-3, .01, 2), vector_of(6, 0, 0), 0, 0);
        const DepthMet met = walk(image, levels, line, 1, 0);
        EXPECT_TRUE(met.behind);
        EXPECT_FALSE(met.blocked);
        EXPECT_FALSE(met.crossed);
    }
}

// Against every pixel in double precision. Doubtful lines are those without a sure hit that graze a front, a back or a corner: a share of
// some 1e-6 a pixel that is passed, more where lines run along borders.
TEST(DepthWalk, BlocksWhatBlocksPixelByPixel)
{
    for (const Case& c : cases) {
        const DepthImage image = random_image(c.width, c.height, c.orthographic, c.steep, c.holes, 9);
        WalkRandom random(11);
        int doubtful = 0, blocked = 0;
        constexpr int lines = 2000;
        for (int i = 0; i < lines; ++i) {
            const DepthLine line = random_line(random, image.view);
            if (!(line.from < line.to)) continue;
            const auto expected = oracle::depth_walk::met(image, line);
            doubtful += !expected.sure;
            blocked += expected.blocked;
            if (expected.sure) {
                EXPECT_EQ(walk(image, DEPTH_LEVELS, line, 0, 0).blocked, expected.blocked) << i;
            }
        }
        EXPECT_LE(doubtful, lines / 50);
        EXPECT_GT(blocked, lines / 20);
    }
}

// depth_line: points of the segment lie on the line in the image. Sums and products of some numbers, each rounded: 1e-5 of the image.
TEST(DepthWalk, LinesAreStraightInTheImage)
{
    for (const bool orthographic : {false, true}) {
        const DepthImage image = random_image(93, 70, orthographic, .004, 0, 1);
        const DepthView& view = image.view;
        WalkRandom random(3);
        for (int i = 0; i < 2000; ++i) {
            const Vec3 from(random.between(-.5, .5), random.between(-.4, .4), random.between(.6, 3)),
                to(random.between(-.5, .5), random.between(-.4, .4), random.between(.6, 3));
            const Vec3 way = to - from;
            const DepthLine line = depth_line(view, vector_of(from.x, from.y, from.z), vector_of(way.x, way.y, way.z), 0, 0);
            if (!(line.from < line.to)) continue;
            for (const double share : {0., .25, .5, 1.}) {
                const double t = line.from + share * (static_cast<double>(line.to) - static_cast<double>(line.from));
                const double s = depth_along(view, line, static_cast<float>(t));
                const Vec3 p = from + way * s;
                const double scale = orthographic ? 1 : p.z;
                EXPECT_NEAR(line.x + t * line.step_x, p.x / scale / view.pixel_x + view.middle_x, 1e-5 * 93 * 4);
                EXPECT_NEAR(line.y + t * line.step_y, view.middle_y - p.y / scale / view.pixel_y, 1e-5 * 93 * 4);
                EXPECT_NEAR(line.value + t * line.step_value, orthographic ? view.far - p.z : 1 / p.z, 1e-5 * 4);
                EXPECT_GE(s, -1e-5);
                EXPECT_LE(s, 1 + 1e-5);
            }
        }
    }
}

} // namespace
} // namespace penumbra::test
