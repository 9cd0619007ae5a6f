// The values of the specialisation constants that are choices, by name: the host writes -DACCUMULATOR=ACCUMULATOR_COMPENSATED
// (choice_constant in host/technique/keys.hpp). They start at 1, so that a name that is missing here, which the preprocessor takes for 0,
// equals none of them.
#ifndef PENUMBRA_COMMON_CHOICES_H
#define PENUMBRA_COMMON_CHOICES_H

// What shares are summed in. soft_shadow_map: binary16 is Appendix A's, emulated. soft_shadow_volume: the papers' buffers, emulated: signed 16 bits with
// 255 levels (Paper I), six bits (Paper III), twelve bits (Paper IV).
#define ACCUMULATOR_BINARY32 1
#define ACCUMULATOR_COMPENSATED 2
#define ACCUMULATOR_BINARY16 3
#define ACCUMULATOR_INT16 4
#define ACCUMULATOR_SIX_BITS 5
#define ACCUMULATOR_TWELVE_BITS 6

// A light's shape; disc: of a sphere, that which faces the receiver.
#define LIGHT_RECTANGLE 1
#define LIGHT_DISC 2

// How an edge's share of the light is found: Paper I; Paper IV, 4.2; Paper III, 3.3.
#define COVERAGE_LINEAR 1
#define COVERAGE_ANALYTIC 2
#define COVERAGE_TEXTURE 3

// Of the coverage table: bilinear in the second end, quadrilinear in both.
#define LOOKUP_NEAREST 1
#define LOOKUP_BILINEAR 2
#define LOOKUP_QUADRILINEAR 3

// Occlusion textures' levels; smooth: N-buffers of a directional light (3.5); and what they are stored in.
#define PREFILTER_NBUFFER 1
#define PREFILTER_MIPMAP 2
#define PREFILTER_TABLE 3
#define PREFILTER_SMOOTH 4
#define STORAGE_BINARY32 1
#define STORAGE_NORMALIZED16 2

#endif
