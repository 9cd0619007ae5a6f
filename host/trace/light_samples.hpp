// Stratified, jittered points on a light, seeded, sixteen at a time (one ray packet).
#pragma once

#include <cstdint>
#include <vector>

namespace penumbra {

constexpr int packet = 16;

// Jittered points of the square [-1, 1]^2 are a + b: the strata's low corners and one stratum's size. Strata that follow one another are
// neighbours (tiles of 4 x 4 where the numbers allow), so that the rays of a packet stay close.
struct Strata {
    int count = 0;
    int columns = 0, rows = 0;
    double step_x = 0, step_y = 0;   // a stratum's size
    std::vector<float> low_x, low_y; // padded to whole packets
};

// columns x rows = count, as near to square as the divisors of `count` allow, columns >= rows. A light without a second dimension gets
// all strata along the first: `flat_x`, `flat_y`.
Strata make_strata(int count, bool flat_x = false, bool flat_y = false);

// What makes a receiver's random numbers its own: the same for a seed, a pixel and a pass, whatever thread or tile it is in.
struct SampleKey {
    std::uint32_t first, second;
};

SampleKey sample_key(std::uint64_t seed, std::uint64_t pixel, std::uint32_t pass);

// Jittered points of strata first to first + 15, in [-1, 1]^2.
void jittered(const Strata& strata, int first, SampleKey key, float (&x)[packet], float (&y)[packet]);

// The square [-1, 1]^2 onto the unit disc, areas in proportion (Shirley and Chiu 1997, A Low Distortion Map Between Disk and Square).
void square_to_disc(float (&x)[packet], float (&y)[packet]);

} // namespace penumbra
