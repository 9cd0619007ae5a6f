// occlusion_texture: error and cost of its settings beside shadow rays and the other techniques of the same run.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "cases.hpp"
#include "rows.hpp"
#include "scenes.hpp"

namespace penumbra::bench {
namespace {

constexpr int reference_samples = 1024;

RayTraced rays(int samples, bool adaptive) { return {.samples = samples, .adaptive = adaptive, .first_samples = 16, .seed = 1}; }

// How uneven a mask is: the mean absolute second difference along rows and columns.
double roughness(const Image& image)
{
    double sum = 0;
    const auto at = [&](int x, int y) { return static_cast<double>(image.pixels[static_cast<std::size_t>(y * image.width + x)]); };
    for (int y = 1; y + 1 < image.height; ++y)
        for (int x = 1; x + 1 < image.width; ++x)
            sum += std::abs(at(x - 1, y) - 2 * at(x, y) + at(x + 1, y)) + std::abs(at(x, y - 1) - 2 * at(x, y) + at(x, y + 1));
    return sum / (2.0 * (image.width - 2) * (image.height - 2));
}

Stage stage_of(const Report& report, const char* name)
{
    const auto at = std::find_if(report.stages.begin(), report.stages.end(), [&](const Stage& stage) { return stage.name == name; });
    return at == report.stages.end() ? Stage{} : *at;
}

// The square of the paper's set-up, turned about the x axis.
Scene tilted_sheet(double degrees)
{
    Scene scene = paper_scene(Occluder::square, {});
    const double turn = degrees * std::acos(-1.0) / 180, c = std::cos(turn), s = std::sin(turn);
    for (auto& p : scene.objects.front().mesh.positions) {
        const double y = p.y - 3.0, z = p.z;
        p.y = static_cast<float>(3 + c * y - s * z);
        p.z = static_cast<float>(s * y + c * z);
    }
    scene.objects.front().name = "sheet at " + std::to_string(static_cast<int>(degrees)) + " degrees";
    return scene;
}

// The paper's set-up with `count` bunnies, half as large, each elsewhere and turned otherwise (Fig. 13).
Scene many_bunnies(int count)
{
    const Scene one = paper_scene(Occluder::bunny, {});
    Scene scene = one;
    TriangleMesh all;
    for (int i = 0; i < count; ++i) {
        const double turn = 2.4 * i, away = 0.45 * std::sqrt(i), c = std::cos(turn), s = std::sin(turn);
        const auto first = static_cast<std::uint32_t>(all.positions.size());
        for (const auto& p : one.objects.front().mesh.positions)
            all.positions.emplace_back(
                Vec3(0.5 * (c * p.x - s * p.z) + away * c, 1 + 0.35 * (i % 4) + 0.5 * p.y, 0.5 * (s * p.x + c * p.z) + away * s));
        for (const auto& t : one.objects.front().mesh.triangles) all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
    scene.objects.front().name = std::to_string(count) + " bunnies";
    scene.objects.front().mesh = std::move(all);
    return scene;
}

void filter_row(const Engine& engine, const Scene& scene, const OcclusionTexture& settings, const Image& reference, double copied)
{
    std::vector<double> build, prefilter, kernel;
    double bytes = 0;
    Mask mask = engine.mask(scene, settings);
    for (int run = 0; run < 15; ++run) {
        mask = engine.mask(scene, settings);
        const Stage stage = stage_of(mask.report, "prefilter");
        build.push_back(stage.ms);
        prefilter.push_back(stage.device_ms);
        kernel.push_back(stage_of(mask.report, "shade").device_ms);
        bytes = static_cast<double>(stage.bytes);
    }
    const Metrics error = compare(mask.visibility, reference);
    const char* const filters[] = {"nbuffer", "mipmap", "summed_area"};
    const Timing built = timing_of(build), on_device = timing_of(prefilter), shaded = timing_of(kernel);
    const double rate = bytes / on_device.min * 1e-6;
    std::printf("# | %s%s | %d | %.4f | %.4f | %+.4f | %.2f | %.2f / %.2f | %.1f | %.0f | %.2f / %.2f | %.1f |\n",
                filters[static_cast<int>(settings.prefilter)],
                settings.prefilter != Prefilter::summed_area && settings.storage == LevelStorage::binary32 ? " binary32" : "",
                settings.resolution, error.mae_shadow, error.rmse_shadow, error.bias_shadow, 1e4 * roughness(mask.visibility), built.min,
                built.median, rate, 100 * rate / copied, shaded.min, shaded.median,
                static_cast<double>(mask.report.peak_device_bytes) / 1048576);
    std::fflush(stdout);
}

// As the paper has it.
constexpr OcclusionTexture paper_settings{.projection_centre = ProjectionCentre::behind_light,
                                          .prefilter = Prefilter::nbuffer,
                                          .combine = Combine::product,
                                          .self_shadow = SelfShadow::fade};

// Processor time of one shading, of all cores together: what others do on the machine hardly moves it. The least of five batches.
double shade_cpu_ms(const Engine& engine, const Scene& scene, const OcclusionTexture& settings)
{
    constexpr int batch = 5;
    const Scene ready = with_depth(scene, settings);
    const Prepared prepared = engine.prepare(ready, settings);
    double best = 1e30;
    for (int run = 0; run < 5; ++run) {
        const std::clock_t begun = std::clock();
        for (int i = 0; i < batch; ++i) engine.shade(prepared, ready.receivers);
        best = std::min(best, 1e3 * static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC / batch);
    }
    return best;
}

void cpu_header(const char* parameter)
{
    std::printf("# | %s | N-buffers: CPU ms a shading | summed-area tables |\n# | --- | --- | --- |\n", parameter);
}

void cpu_row(const Engine& engine, const Scene& scene, const char* parameter)
{
    std::printf("# | %s | %.1f | %.1f |\n", parameter, shade_cpu_ms(engine, scene, {.prefilter = Prefilter::nbuffer}),
                shade_cpu_ms(engine, scene, {.prefilter = Prefilter::summed_area}));
    std::fflush(stdout);
}

} // namespace

void occlusion(const Engine& engine)
{
    const Scene scene = paper_scene(Occluder::bunny, {});
    const Image reference = reference_of(engine, scene, 4096);
    const auto row = [&](const OcclusionTexture& settings, double parameter) {
        emit(engine, scene, settings, reference, "occlusion", parameter, 9);
    };
    for (const Combine combine : {Combine::product, Combine::sum, Combine::max, Combine::layered, Combine::layered_max})
        for (const int slices : {4, 16}) row({.slices = slices, .combine = combine}, slices);
    for (const int slices : {4, 16}) row({.slices = slices, .resolution = 512}, slices);
    row({.slices = 64}, 64);
    for (const Placement placement : {Placement::reciprocal, Placement::occupied}) row({.placement = placement}, 16);
    row({.combine = Combine::product, .leak_fix = true}, 16);
    for (const SelfShadow self : {SelfShadow::fade, SelfShadow::own, SelfShadow::omit}) row({.self_shadow = self}, 16);
    row(paper_settings, 16);
    for (const Combine combine : {Combine::product, Combine::layered, Combine::layered_max})
        for (const int splits : {2, 4}) row({.combine = combine, .light_splits = splits}, splits);
    emit(engine, scene, SoftShadowMap{}, reference, "occlusion", 128, 9);
    for (const int splits : {1, 4}) emit(engine, scene, SoftShadowVolume{.light_splits = splits}, reference, "occlusion", splits, 5);
    for (const bool adaptive : {false, true})
        for (const int samples : {4, 16, 64, 256})
            if (!adaptive || samples > 16) emit(engine, scene, rays(samples, adaptive), reference, "occlusion", samples, 3);
}

void occlusion_filters(const Engine& engine)
{
    const Scene scene = with_depth(paper_scene(Occluder::bunny, {}), OcclusionTexture{});
    const Image reference = reference_of(engine, scene, 4096);
    const double copied = copy_rate(engine);
    std::printf("# the reference's roughness %.2f; copy %.1f GB/s (read and write)\n", 1e4 * roughness(reference), copied);
    std::puts("# | filter | texels | MAE shadow | RMSE shadow | bias | roughness x 10000 | build ms min / median | GB/s | % of copy | "
              "shade kernel ms min / median "
              "| MiB on device |");
    std::puts("# | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for (const int texels : {64, 256, 512}) {
        for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap})
            for (const LevelStorage storage : {LevelStorage::normalized16, LevelStorage::binary32})
                filter_row(engine, scene, {.resolution = texels, .prefilter = prefilter, .storage = storage}, reference, copied);
        filter_row(engine, scene, {.resolution = texels, .prefilter = Prefilter::summed_area}, reference, copied);
    }
}

void occlusion_light(const Engine& engine)
{
    cpu_header("light's side");
    for (const double side : {0.1, 0.2, 0.5, 1.0, 2.0})
        cpu_row(engine, paper_scene(Occluder::bunny, {.light_side = side}), std::to_string(side).substr(0, 3).c_str());
    for (const double side : {0.1, 0.2, 0.5, 1.0, 2.0}) {
        const Scene scene = paper_scene(Occluder::bunny, {.light_side = side});
        const Image reference = reference_of(engine, scene, reference_samples);
        for (const Combine combine : {Combine::product, Combine::layered_max})
            emit(engine, scene, OcclusionTexture{.combine = combine}, reference, "occlusion_light", side, 9);
        emit(engine, scene, SoftShadowMap{}, reference, "occlusion_light", side, 9);
        emit(engine, scene, rays(64, true), reference, "occlusion_light", side, 3);
    }
    for (const double degrees : {0.53, 5.0}) {
        Scene scene = paper_scene(Occluder::bunny, {});
        scene.light = DirectionalLight{.direction = {0, -1, 0}, .angular_diameter_deg = degrees, .up = {}};
        scene.receivers.camera = scene.occluders.camera =
            LightCamera{.tan_half_fov = {}, .half_extent = Vec2(3, 3), .center = Vec3(0, 8, 0)};
        const Image reference = reference_of(engine, scene, reference_samples);
        for (const Combine combine : {Combine::product, Combine::layered_max})
            emit(engine, scene, OcclusionTexture{.combine = combine}, reference, "occlusion_sun", degrees, 9);
        emit(engine, scene, rays(64, true), reference, "occlusion_sun", degrees, 3);
    }
}

void occlusion_casters(const Engine& engine)
{
    cpu_header("triangles");
    for (const std::uint32_t rings : {22U, 45U, 89U, 179U, 358U}) {
        const TriangleMesh mesh = bumpy_ball(rings);
        cpu_row(engine, paper_scene("ball", mesh, {}), std::to_string(mesh.triangles.size()).c_str());
    }
    // Triangles: 1.8, 7.9, 31, 127, 511 thousand.
    for (const std::uint32_t rings : {22U, 45U, 89U, 179U, 358U}) {
        const TriangleMesh mesh = bumpy_ball(rings);
        const Scene scene = paper_scene("ball", mesh, {});
        const Image reference = reference_of(engine, scene, reference_samples);
        emit(engine, scene, OcclusionTexture{}, reference, "occlusion_casters", static_cast<double>(mesh.triangles.size()), 9);
    }
    for (const int count : {1, 2, 4, 7}) {
        const Scene scene = many_bunnies(count);
        const Image reference = reference_of(engine, scene, reference_samples);
        const double triangles = static_cast<double>(scene.objects.front().mesh.triangles.size());
        for (const int slices : {4, 16})
            emit(engine, scene, OcclusionTexture{.slices = slices}, reference, "occlusion_bunnies", triangles, 9);
        emit(engine, scene, paper_settings, reference, "occlusion_bunnies", triangles, 9);
        emit(engine, scene, SoftShadowMap{}, reference, "occlusion_bunnies", triangles, 9);
        emit(engine, scene, SoftShadowVolume{}, reference, "occlusion_bunnies", triangles, 5);
        emit(engine, scene, rays(64, true), reference, "occlusion_bunnies", triangles, 3);
    }
}

void occlusion_sheet(const Engine& engine)
{
    const auto row = [&](const Scene& scene, const OcclusionTexture& settings, const Image& reference) {
        emit(engine, scene, settings, reference, "occlusion_sheet", settings.slices, 3);
    };
    const Scene level = tilted_sheet(0), tilted = tilted_sheet(45);
    const Image level_reference = reference_of(engine, level, 4096), tilted_reference = reference_of(engine, tilted, 4096);
    for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap, Prefilter::summed_area})
        row(level, {.prefilter = prefilter}, level_reference);
    for (const Combine combine : {Combine::product, Combine::sum, Combine::max, Combine::layered, Combine::layered_max})
        for (const int slices : {4, 16, 64}) row(tilted, {.slices = slices, .combine = combine}, tilted_reference);
    for (const Combine combine : {Combine::product, Combine::layered})
        row(tilted, {.prefilter = Prefilter::nbuffer, .combine = combine}, tilted_reference);
    row(tilted, paper_settings, tilted_reference);
}

} // namespace penumbra::bench
