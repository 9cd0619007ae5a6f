// A row of a bench: what was run, how far it is from the reference, and what it took.
#pragma once

#include <string>
#include <vector>

#include <penumbra/penumbra.hpp>

namespace penumbra::bench {

struct Timing {
    double min = 0, median = 0, max = 0;
};
Timing timing_of(std::vector<double> samples);

struct Row {
    std::string bench, scene, technique, settings;
    double parameter = 0; // what the bench sweeps
    Metrics error;
    double prepare_ms = 0;  // median
    Timing shade_ms;        // wall
    double kernel_ms = 0;   // median of the shade stage by the device's clock
    double pairs = 0;       // (texel, receiver) pairs, or rays
    double pairs_per_s = 0; // of the kernels' time, or of the wall time for rays
    double device_bytes = 0;
    double share_shaded = 1; // of the receivers, with a tolerance
    double render_ms = 0;    // median: occluder depth from the objects, their hierarchy with it; 0: the technique needs none
};

// Prints what is measured, as a comment: version, device, driver.
void print_engine(const Engine& engine);

// Prints the column names, then rows as they come (CSV).
void print_header();
void print(const Row& row);

// The mask of `technique`, prepared once and shaded `runs` times after a warm-up; errors are against `reference`.
Row measure(const Engine& engine, const Scene& scene, const Technique& technique, const Image& reference, int runs);

// Measures and prints a row of `bench`, named after the scene's first object.
void emit(const Engine& engine, const Scene& scene, const Technique& technique, const Image& reference, const char* bench, double parameter,
          int runs);

// Ray-traced visibility of the scene.
Image reference_of(const Engine& engine, const Scene& scene, int samples);

} // namespace penumbra::bench
