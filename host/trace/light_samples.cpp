#include "trace/light_samples.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace penumbra {
namespace {

// SplitMix64's finaliser (Steele, Lea, Flood 2014): every bit of the input reaches every bit of the output.
std::uint64_t mixed(std::uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

} // namespace

Strata make_strata(int count, bool flat_x, bool flat_y)
{
    Strata strata;
    strata.count = count;
    strata.rows = static_cast<int>(std::sqrt(static_cast<double>(count)));
    while (count % strata.rows != 0) --strata.rows;
    if (flat_y) strata.rows = 1;
    if (flat_x) strata.rows = count;
    strata.columns = count / strata.rows;
    strata.step_x = 2.0 / strata.columns;
    strata.step_y = 2.0 / strata.rows;

    // Tile by tile, then what is left of the tiles at the right and at the bottom. Padding repeats the last stratum.
    const auto padded = static_cast<std::size_t>((count + packet - 1) / packet) * packet;
    strata.low_x.reserve(padded);
    strata.low_y.reserve(padded);
    for (int tile_y = 0; tile_y < strata.rows; tile_y += 4)
        for (int tile_x = 0; tile_x < strata.columns; tile_x += 4)
            for (int y = tile_y; y < std::min(tile_y + 4, strata.rows); ++y)
                for (int x = tile_x; x < std::min(tile_x + 4, strata.columns); ++x) {
                    strata.low_x.push_back(static_cast<float>(x * strata.step_x - 1));
                    strata.low_y.push_back(static_cast<float>(y * strata.step_y - 1));
                }
    strata.low_x.resize(padded, strata.low_x.back());
    strata.low_y.resize(padded, strata.low_y.back());
    return strata;
}

SampleKey sample_key(std::uint64_t seed, std::uint64_t pixel, std::uint32_t pass)
{
    // Odd multiples of the golden ratio keep neighbouring pixels, passes and seeds apart before they are mixed.
    const std::uint64_t key = mixed(mixed(seed + 0x9e3779b97f4a7c15u * (pass + 1u)) + 0x9e3779b97f4a7c15u * (pixel + 1));
    return {static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32)};
}

void jittered(const Strata& strata, int first, SampleKey key, float (&x)[packet], float (&y)[packet])
{
    const float* const low_x = strata.low_x.data() + first;
    const float* const low_y = strata.low_y.data() + first;
    // 2^-16 of a stratum is the step of a jitter, plus half a step: its mean is the stratum's middle.
    const auto step_x = static_cast<float>(strata.step_x * 0x1p-16), step_y = static_cast<float>(strata.step_y * 0x1p-16);
    for (int i = 0; i < packet; ++i) {
        // A counter goes through a 32-bit mixer (Wellons 2018, hash prospector) with the key in two places; 16 bits for each axis.
        std::uint32_t h = static_cast<std::uint32_t>(first + i) * 0x9e3779b9u + key.first;
        h = (h ^ (h >> 16)) * 0x7feb352du ^ key.second;
        h = (h ^ (h >> 15)) * 0x846ca68bu;
        h ^= h >> 16;
        x[i] = low_x[i] + (static_cast<float>(static_cast<std::int32_t>(h & 0xffff)) + 0.5f) * step_x;
        y[i] = low_y[i] + (static_cast<float>(static_cast<std::int32_t>(h >> 16)) + 0.5f) * step_y;
    }
}

void square_to_disc(float (&x)[packet], float (&y)[packet])
{
    constexpr auto quarter_pi = static_cast<float>(std::numbers::pi / 4);
    for (int i = 0; i < packet; ++i) {
        // The larger coordinate is the radius; the other, in eighths of a turn, the angle from the larger one's axis.
        const bool wide = std::abs(x[i]) > std::abs(y[i]);
        const float radius = wide ? x[i] : y[i];
        const float other = wide ? y[i] : x[i];
        const float angle = radius != 0 ? quarter_pi * other / radius : 0;

        // Taylor series on [-pi/4, pi/4]: what is left out is below (pi/4)^10 / 10! = 3e-8 and (pi/4)^11 / 11! = 2e-9, half a float32's
        // last place.
        const float a2 = angle * angle;
        const float cosine = 1 + a2 * (-1.f / 2 + a2 * (1.f / 24 + a2 * (-1.f / 720 + a2 * (1.f / 40320))));
        const float sine = angle * (1 + a2 * (-1.f / 6 + a2 * (1.f / 120 + a2 * (-1.f / 5040 + a2 * (1.f / 362880)))));
        x[i] = radius * (wide ? cosine : sine);
        y[i] = radius * (wide ? sine : cosine);
    }
}

} // namespace penumbra
