// 01: the library on the default device, with depth maps made in code.
//
// Expected: mean visibility 0.7500
//
// A square light of side 1 hangs 6 above a floor; a square of side 2 hangs in between, 4 below the light. Every point of the light throws
// the square's shadow onto the floor, enlarged by 6 / 4: an area of (2 * 6 / 4)^2 = 9. The picture shows 6 x 6 of the floor, so a quarter
// of the light is missing from it.
#include <cstdio>
#include <numeric>

#include <penumbra/penumbra.hpp>

int main()
try {
    constexpr int size = 256; // texels of each map, which cover -0.5 to 0.5 in tangents
    constexpr int pixels = size * size;
    const penumbra::LightCamera camera{.tan_half_fov = penumbra::Vec2(0.5, 0.5), .half_extent = {}, .center = {}};

    // At depth 4 the map is 4 wide: the square fills its middle half.
    penumbra::DepthMap square{size, size, std::vector<float>(pixels, penumbra::nothing_there)};
    for (int y = size / 4; y < size * 3 / 4; ++y)
        for (int x = size / 4; x < size * 3 / 4; ++x) square.at(x, y) = 4;
    const penumbra::DepthMap floor{size, size, std::vector<float>(pixels, 6.0f)};

    penumbra::Scene scene;
    scene.light = penumbra::RectangleLight{.center = {0, 6, 0}, .half_u = {0.5, 0, 0}, .half_v = {0, 0, -0.5}, .emission = {}};
    scene.occluders = {.camera = camera, .width = size, .height = size, .front = square, .back = {}, .layers = {}};
    scene.receivers = {.camera = camera, .width = size, .height = size, .depth = floor};

    const penumbra::Engine engine;
    const penumbra::Mask mask = engine.mask(scene, penumbra::SoftShadowMap{.sides = penumbra::Sides::front});

    const std::vector<float>& visibility = mask.visibility.pixels;
    std::printf("mean visibility %.4f\n", std::accumulate(visibility.begin(), visibility.end(), 0.0) / pixels);
} catch (const penumbra::Error& error) {
    std::fprintf(stderr, "01_library: %s\n", error.what());
    return penumbra::exit_code(error.code());
}
