// Hand-made lights and depth maps that the tests of several rooms share.
//
// The light sits at the origin and shines along -Z with u = +X and v = +Y, so that its camera has the frame that a Frame starts with.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>

namespace penumbra::test {

inline RectangleLight rectangle_light(double half_u, double half_v)
{
    return {.center = {0, 0, 0}, .half_u = {half_u, 0, 0}, .half_v = {0, half_v, 0}, .emission = {}};
}

inline PointLight point_light() { return {.center = {0, 0, 0}, .direction = {0, 0, -1}, .up = Vec3(0, 1, 0)}; }

inline LightCamera light_view(double tangent_x, double tangent_y)
{
    return {.tan_half_fov = Vec2(tangent_x, tangent_y), .half_extent = {}, .center = {}};
}
inline LightCamera light_view(double tangent = 1) { return light_view(tangent, tangent); }

// A map from a function of the pixel.
inline DepthMap map_of(int width, int height, const std::function<float(int x, int y)>& depth)
{
    DepthMap map{.width = width, .height = height, .depth = {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) map.depth.push_back(depth(x, y));
    return map;
}

inline DepthMap flat(int width, int height, float depth)
{
    return map_of(width, height, [depth](int, int) { return depth; });
}

// A plane parallel to the light, at `depth` inside columns [x0, x1) and rows [y0, y1); nothing elsewhere.
struct TexelBox {
    int x0, x1, y0, y1;
    bool holds(int x, int y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
};
inline DepthMap boxes(int width, int height, float depth, const std::vector<TexelBox>& list)
{
    return map_of(width, height, [&](int x, int y) {
        for (const TexelBox& box : list)
            if (box.holds(x, y)) return depth;
        return nothing_there;
    });
}

// Depths from `near` to `far`, uniform in disparity, with a share of holes.
inline DepthMap random_map(int width, int height, double near, double far, double holes, std::uint32_t seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    return map_of(width, height, [&](int, int) {
        const bool hole = unit(random) < holes;
        const double disparity = 1 / far + unit(random) * (1 / near - 1 / far);
        return hole ? nothing_there : static_cast<float>(1 / disparity);
    });
}

inline Occluders occluders(const LightCamera& camera, DepthMap front)
{
    Occluders result{.camera = camera, .width = front.width, .height = front.height, .front = {}, .back = {}, .layers = {}};
    result.front = std::move(front);
    return result;
}

inline Receivers receivers(const CameraSpec& camera, DepthMap depth)
{
    Receivers result{.camera = camera, .width = depth.width, .height = depth.height, .depth = {}};
    result.depth = std::move(depth);
    return result;
}

// What `call` throws; the test fails when it throws nothing.
template <class Call> Error error_of(Call&& call)
{
    try {
        call();
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << "no error was thrown";
    return Error(ErrorCode::internal, "");
}

inline bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// FNV-1a over the bytes of floats: equal hashes stand for equal bits.
inline std::uint64_t hash_of(const std::vector<float>& values)
{
    std::uint64_t hash = 14695981039346656037u;
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    for (std::size_t i = 0; i < values.size() * sizeof(float); ++i) hash = (hash ^ bytes[i]) * 1099511628211u;
    return hash;
}

} // namespace penumbra::test
