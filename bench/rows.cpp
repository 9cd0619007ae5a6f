#include "rows.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace penumbra::bench {
namespace {

std::string settings_text(const Report& report)
{
    struct Text {
        std::string operator()(bool v) const { return v ? "true" : "false"; }
        std::string operator()(std::int64_t v) const { return std::to_string(v); }
        std::string operator()(double v) const
        {
            char text[32];
            std::snprintf(text, sizeof text, "%g", v);
            return text;
        }
        std::string operator()(const std::string& v) const { return v; }
    };
    std::string text;
    for (const auto& [key, value] : report.settings) text += (text.empty() ? "" : " ") + key + "=" + std::visit(Text{}, value);
    return text;
}

double kernel_time(const Report& report)
{
    for (const Stage& stage : report.stages)
        if (stage.name == "shade") return stage.device_ms > 0 ? stage.device_ms : stage.ms;
    return 0;
}

} // namespace

Timing timing_of(std::vector<double> samples)
{
    std::sort(samples.begin(), samples.end());
    return {.min = samples.front(), .median = samples[samples.size() / 2], .max = samples.back()};
}

void print_engine(const Engine& engine)
{
    std::printf("# penumbra %s, device %s (%s), %u compute units\n", version().c_str(), engine.device().name.c_str(),
                engine.device().driver.c_str(), engine.device().compute_units);
}

void print_header()
{
    std::puts("bench,scene,technique,settings,parameter,mae_shadow,rmse_shadow,bias_shadow,max,p99_shadow,prepare_ms,shade_ms_min,shade_ms_"
              "median,"
              "shade_ms_max,kernel_ms,pairs,pairs_per_s,device_bytes,render_ms");
}

void print(const Row& r)
{
    std::printf("%s,%s,%s,%s,%g,%.5f,%.5f,%.5f,%.5f,%.5f,%.3f,%.3f,%.3f,%.3f,%.3f,%.0f,%.4g,%.0f,%.3f\n", r.bench.c_str(), r.scene.c_str(),
                r.technique.c_str(), r.settings.c_str(), r.parameter, r.error.mae_shadow, r.error.rmse_shadow, r.error.bias_shadow,
                r.error.max, r.error.p99_shadow, r.prepare_ms, r.shade_ms.min, r.shade_ms.median, r.shade_ms.max, r.kernel_ms, r.pairs,
                r.pairs_per_s, r.device_bytes, r.render_ms);
    std::fflush(stdout);
}

namespace {

// What a mask from the objects takes beside preparing and shading. Receivers are given.
double render_time(const Scene& ready, const Scene& scene, const Technique& technique, int runs)
{
    if (!ready.occluders.front && !ready.occluders.back) return 0;
    Scene given = ready;
    given.occluders = scene.occluders;
    std::vector<double> times;
    for (int run = 0; run < std::min(runs, 3); ++run) {
        const auto begin = std::chrono::steady_clock::now();
        with_depth(given, technique);
        times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    }
    return timing_of(times).median;
}

} // namespace

Row measure(const Engine& engine, const Scene& scene, const Technique& technique, const Image& reference, int runs)
{
    const Scene ready = with_depth(scene, technique);
    engine.mask(ready, technique); // builds the kernels

    std::vector<double> prepare, shade, kernel;
    Mask mask;
    for (int run = 0; run < runs; ++run) {
        mask = engine.mask(ready, technique);
        prepare.push_back(mask.report.prepare_ms);
        shade.push_back(mask.report.shade_ms);
        kernel.push_back(kernel_time(mask.report));
    }
    Row row{
        .bench = {}, .scene = {}, .technique = mask.report.technique, .settings = settings_text(mask.report), .error = {}, .shade_ms = {}};
    row.error = compare(mask.visibility, reference);
    row.prepare_ms = timing_of(prepare).median;
    row.shade_ms = timing_of(shade);
    row.kernel_ms = timing_of(kernel).median;
    row.pairs = static_cast<double>(mask.report.pairs);
    row.pairs_per_s = row.pairs / (row.kernel_ms * 1e-3);
    if (mask.report.receivers > 0) row.share_shaded = static_cast<double>(mask.report.receivers_shaded) / static_cast<double>(mask.report.receivers);
    row.render_ms = render_time(ready, scene, technique, runs);
    row.device_bytes = static_cast<double>(mask.report.peak_device_bytes);
    return row;
}

void emit(const Engine& engine, const Scene& scene, const Technique& technique, const Image& reference, const char* bench, double parameter,
          int runs)
{
    Row row = measure(engine, scene, technique, reference, runs);
    row.bench = bench;
    row.scene = scene.objects.front().name;
    row.parameter = parameter;
    print(row);
}

Image reference_of(const Engine& engine, const Scene& scene, int samples)
{
    return engine.mask(scene, RayTraced{.samples = samples, .adaptive = false, .first_samples = 16, .seed = 4711}).visibility;
}

} // namespace penumbra::bench
