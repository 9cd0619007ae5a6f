// A plane that nothing shadows is lit: as what casts and what receives at once, at any tilt, distance and noise.
#include "depth_image/images.hpp"

namespace penumbra::test {
namespace {

constexpr int width = 61, height = 37;

// The camera looks at a plane from `distance`; the light stands `aside` the view before the plane, at a place that is never behind it.
Scene lit_plane(const Plane& plane, double distance, double half, const Noise& noise)
{
    const Plane scaled{plane.at_middle / distance, plane.slope_x / distance, plane.slope_y / distance};
    const DepthMap map = image_of(width, height, scaled, noise);
    const Camera camera = camera_for(width, height, half);
    Scene scene;
    // The plane's normal towards the camera: 1/z = a + b x/z + c y/z in camera coordinates is a z + b x + c y = 1.
    const double pixel = 2 * camera.half_extent.x / width;
    const Vec3 normal = Vec3(-scaled.slope_x / pixel, scaled.slope_y / pixel, scaled.at_middle).normalized(); // world: z backwards
    const Vec3 middle(0, 0, -1 / scaled.at_middle), u = normal.cross(Vec3(.3, 1, .2)).normalized(), v = normal.cross(u);
    scene.light = RectangleLight{.center = middle + normal * (2 * distance) + u * (.5 * distance),
                                 .half_u = v * (.3 * distance), // shines along half_v x half_u = -normal
                                 .half_v = u * (-.2 * distance),
                                 .emission = {}};
    scene.objects.push_back(
        {.name = "seen", .mesh = {}, .casts = true, .receives = true, .seen = SeenSurface{.depth = map, .camera = camera}});
    scene.receivers = {
        .camera = PinholeCamera{.frame = camera.frame, .tan_half_fov = camera.half_extent}, .width = width, .height = height, .depth = map};
    return scene;
}

// Steps of disparity a pixel, of that in the middle. Under a narrow field of view they graze: at the steepest by 2.4 degrees, and disparity
// falls to a seventh across the image.
const std::vector<Plane> planes = {{1, 0, 0}, {1, 4e-3, 0}, {1, 0, -.01}, {1, -.01, .015}, {1, .02, .01}, {1, 0, .04}};

void expect_lit(const Engine& engine, const Scene& scene, const Technique& technique)
{
    const Mask mask = engine.mask(scene, technique);
    std::size_t dark = 0;
    float least = 1;
    for (const float v : mask.visibility.pixels) dark += v != 1, least = std::min(least, v);
    EXPECT_EQ(dark, 0u) << "of " << width * height << " pixels, the darkest " << least;
}

void expect_lit_planes(const Technique& technique)
{
    const Engine engine;
    for (const Plane& plane : planes)
        for (const double distance : {1e-6, 1., 1e6})
            for (const double half : {.6, .05})
                for (const double noise : {0., 1e-6, 1e-3}) {
                    SCOPED_TRACE(testing::Message() << "slopes " << plane.slope_x << ", " << plane.slope_y << ", distance " << distance
                                                    << ", half " << half << ", noise " << noise);
                    expect_lit(engine, lit_plane(plane, distance, half, {noise}), technique);
                }
}

// The same scene is not lit for want of casters: a square that floats before the plane casts a shadow on it.
TEST(DepthSurface, ASquareBeforeThePlaneShadowsIt)
{
    const Engine engine;
    for (const double distance : {1e-6, 1., 1e6}) {
        Scene scene = lit_plane({1, 0, 0}, distance, .6, {});
        for (int y = 12; y < 22; ++y)
            for (int x = 25; x < 35; ++x) scene.receivers.depth->at(x, y) = static_cast<float>(.8 * distance);
        scene.objects[0].seen->depth = *scene.receivers.depth;
        for (const Technique& technique : {Technique{DepthTrace{}}, Technique{RayTraced{.samples = 64}}}) {
            const Mask mask = engine.mask(scene, technique);
            EXPECT_GT(std::count_if(mask.visibility.pixels.begin(), mask.visibility.pixels.end(), [](float v) { return v < .5f; }), 5)
                << distance;
        }
    }
}

TEST(DepthSurface, ALitPlaneStaysLitByDepthTrace) { expect_lit_planes(DepthTrace{.samples = 32}); }
TEST(DepthSurface, ALitPlaneStaysLitByRays) { expect_lit_planes(RayTraced{.samples = 32}); }

} // namespace
} // namespace penumbra::test
