#include "cases.hpp"

#include <cmath>

#include "rows.hpp"
#include "scenes.hpp"

namespace penumbra::bench {
namespace {

constexpr int reference_samples = 4096, sweep_samples = 1024;

// As published: patches summed.
SoftShadowMap paper(Sides sides, Accumulator accumulator = Accumulator::binary32)
{
    return {.preset = Preset::paper, .visibility = PatchVisibility::sum, .sides = sides, .layers = 0, .accumulator = accumulator, .tolerance = 0};
}

void emit(Row row, const char* bench, Occluder occluder, double parameter)
{
    row.bench = bench;
    row.scene = name(occluder);
    row.parameter = parameter;
    print(row);
}

// One- and two-sided masks of a scene against its ray-traced reference.
void both_versions(const Engine& engine, const char* bench, Occluder occluder, const SceneOptions& options, double parameter, int runs)
{
    const Scene scene = paper_scene(occluder, options);
    const Image reference = reference_of(engine, scene, sweep_samples);
    emit(measure(engine, scene, paper(Sides::front), reference, runs), bench, occluder, parameter);
    if (occluder != Occluder::square)
        emit(measure(engine, scene, paper(Sides::both), reference, runs), bench, occluder, parameter);
}

} // namespace

void bunny(const Engine& engine)
{
    const Scene scene = paper_scene(Occluder::bunny, {});
    const Image reference = reference_of(engine, scene, reference_samples);
    for (const int texels : {64, 128, 256, 512})
        for (const Sides sides : {Sides::front, Sides::back, Sides::both}) {
            const Scene at = paper_scene(Occluder::bunny, {.occluder_resolution = texels});
            emit(measure(engine, at, paper(sides), reference, 15), "bunny", Occluder::bunny, texels);
        }
    for (const int texels : {64, 128, 256, 512}) {
        const Scene at = paper_scene(Occluder::bunny, {.occluder_resolution = texels});
        for (const Sides sides : {Sides::front, Sides::both}) emit(measure(engine, at, SoftShadowMap{.visibility = PatchVisibility::united, .sides = sides}, reference, 15), "bunny", Occluder::bunny, texels);
    }
    for (const bool adaptive : {false, true})
        for (const int samples : {16, 64, 256, 1024}) {
            const RayTraced rays{.samples = samples, .adaptive = adaptive, .first_samples = 16, .seed = 1};
            if (!adaptive || samples > 16) emit(measure(engine, scene, rays, reference, 3), "bunny", Occluder::bunny, samples);
        }
}

void resolution(const Engine& engine)
{
    // Sizes that are not powers of two, as the paper's; the square's edges then fall anywhere between texel borders.
    for (const Occluder occluder : {Occluder::square, Occluder::bunny, Occluder::horse})
        for (const int texels : {25, 50, 75, 100, 125, 150, 175, 200, 250, 300, 400, 500})
            both_versions(engine, "resolution", occluder, {.occluder_resolution = texels, .receiver_resolution = 256}, texels, 1);
}

void light_size(const Engine& engine)
{
    for (const Occluder occluder : {Occluder::square, Occluder::bunny, Occluder::horse})
        for (const double side : {0.01, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.4, 2.0, 3.0})
            both_versions(engine, "light_size", occluder, {.light_side = side, .receiver_resolution = 256}, side, 3);

    // Fig. 24: the same over maps of several resolutions, two-sided.
    for (const double side : {0.01, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.4, 2.0, 3.0}) {
        const Image reference =
            reference_of(engine, paper_scene(Occluder::bunny, {.light_side = side, .receiver_resolution = 256}), sweep_samples);
        for (const auto& [texels, bench] :
             {std::pair{64, "light_size_64"}, {128, "light_size_128"}, {256, "light_size_256"}, {512, "light_size_512"}}) {
            const Scene scene =
                paper_scene(Occluder::bunny, {.light_side = side, .occluder_resolution = texels, .receiver_resolution = 256});
            emit(measure(engine, scene, paper(Sides::both), reference, 3), bench, Occluder::bunny, side);
        }
    }
}

void lateral(const Engine& engine)
{
    for (const Occluder occluder : {Occluder::square, Occluder::bunny, Occluder::horse})
        for (const double x : {-0.9, -0.6, -0.3, 0.0, 0.3, 0.6, 0.9})
            both_versions(engine, "lateral", occluder, {.sideways = x, .receiver_resolution = 256}, x, 1);
}

void vertical(const Engine& engine)
{
    // The occluders are up to 2 high: 1 is contact with the plane, 7 with the light. Near the light they fill the map's view.
    for (const Occluder occluder : {Occluder::square, Occluder::bunny, Occluder::horse})
        for (const double y : {1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5})
            both_versions(engine, "vertical", occluder, {.height = y, .receiver_resolution = 256}, y, 1);
}

void texels(const Engine& engine)
{
    const Scene scene = paper_scene(Occluder::bunny, {});
    const Image reference = reference_of(engine, scene, sweep_samples);
    for (const int side : {32, 64, 96, 128, 192, 256, 384, 512, 768, 1024}) {
        const Scene at = paper_scene(Occluder::bunny, {.occluder_resolution = side});
        for (const Sides sides : {Sides::front, Sides::both})
            emit(measure(engine, at, paper(sides), reference, 5), "texels", Occluder::bunny,
                 static_cast<double>(side) * side);
    }
}

void accumulators(const Engine& engine)
{
    const Scene scene = paper_scene(Occluder::bunny, {});
    const Image reference = reference_of(engine, scene, sweep_samples);
    for (const int side : {64, 128, 256, 512, 1024}) {
        const Scene at = paper_scene(Occluder::bunny, {.occluder_resolution = side});
        for (const Accumulator accumulator : {Accumulator::binary16, Accumulator::binary32, Accumulator::compensated})
            emit(measure(engine, at, paper(Sides::front, accumulator), reference, 5), "accumulators",
                 Occluder::bunny, side);
    }
}

void baselines(const Engine& engine)
{
    const Scene scene = paper_scene(Occluder::bunny, {.occluder_resolution = 512});
    const Image reference = reference_of(engine, scene, sweep_samples);
    emit(measure(engine, scene, ShadowMap{}, reference, 15), "baselines", Occluder::bunny, 1);
    for (const int taps : {3, 9, 17, 33})
        emit(measure(engine, scene, ShadowMap{.filter = ShadowFilter::percentage_closer, .taps = taps}, reference, 15), "baselines",
             Occluder::bunny, taps);
    emit(measure(engine, scene, ShadowMap{.filter = ShadowFilter::bicubic}, reference, 15), "baselines", Occluder::bunny, 4);
}

void large(const Engine& engine)
{
    const SceneOptions options{.light_side = 0.2, .occluder_resolution = 2048, .receiver_resolution = 4096};
    const Scene scene = paper_scene(Occluder::bunny, options);
    const Image reference = reference_of(engine, scene, 64);
    emit(measure(engine, scene, paper(Sides::front), reference, 1), "large", Occluder::bunny, 4096);
}

} // namespace penumbra::bench
