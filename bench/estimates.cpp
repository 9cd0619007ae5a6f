// Report::error_estimate of the suite's scenes beside the error that it is of: by rays, and, of the maps alone, by maps of a third.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <penumbra/mask_job.hpp>

#include "cases.hpp"
#include "suite_scenes.hpp"

namespace penumbra::bench {
namespace {

void print_estimate(const Engine& engine, const std::string& name, const Scene& scene, const Technique& technique, const std::string& setting, const Image& reference)
{
    MaskJob job = job_of(scene, technique);
    job.error_estimate = true;
    engine.masks(job, {}, [&](NamedMask&& named) {
        const Metrics found = compare(named.mask.visibility, reference);
        const auto& estimate = named.mask.report.error_estimate;
        if (!estimate) return;
        double ms = 0;
        for (const Stage& stage : named.mask.report.stages)
            if (stage.name == "estimate error") ms = stage.ms;
        std::printf("estimates,%s,%s,%s,%s,%.5f,%.5f,%.2f,%.5f,%.5f,%.2f,%.1f\n", name.c_str(), kind_of(technique).c_str(), setting.c_str(), estimate->by.c_str(), found.mae_shadow, estimate->mean,
                    estimate->mean / found.mae_shadow, found.p99_shadow, estimate->p99, estimate->p99 / found.p99_shadow, ms);
        std::fflush(stdout);
    });
}

// The maps of a scene, without what they were rendered from.
Scene maps_alone(const Scene& scene)
{
    Scene maps = with_depth(scene, SoftShadowMap{});
    maps.occluders.front->fine = maps.occluders.back->fine = nullptr;
    for (DepthMap& layer : maps.occluders.layers) layer.fine = nullptr;
    maps.objects.clear();
    return maps;
}

} // namespace

void estimates(const Engine& engine)
{
    std::puts("bench,scene,technique,settings,by,mae_shadow,estimate_mean,ratio_mean,p99_shadow,estimate_p99,ratio_p99,estimate_ms");
    for (const int texels : {512, 128})
        for (SuiteScene& one : suite_scenes(texels, 512)) {
            const Image reference = suite_reference(engine, one);
            const std::string size = "map=" + std::to_string(texels);
            print_estimate(engine, one.name, one.scene, SoftShadowMap{}, size, reference);
            print_estimate(engine, one.name, one.scene, SoftShadowMap{.tolerance = 0.12}, size + " tolerance=0.12", reference);
            print_estimate(engine, one.name, maps_alone(one.scene), SoftShadowMap{}, size + " given", reference);
            if (texels == 128) continue;
            print_estimate(engine, one.name, one.scene, SoftShadowVolume{}, "default", reference);
            print_estimate(engine, one.name, one.scene, OcclusionTexture{}, "default", reference);
        }
}

} // namespace penumbra::bench
