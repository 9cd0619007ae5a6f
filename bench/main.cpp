// penumbra_bench BENCH...: runs benches and prints their rows as CSV. Without arguments it lists them.
#include <cstdio>
#include <cstring>

#include <penumbra/penumbra.hpp>

#include "cases.hpp"
#include "rows.hpp"

namespace {

struct Case {
    const char* name;
    void (*run)(const penumbra::Engine&);
    const char* meaning;
};

using namespace penumbra::bench;

constexpr Case cases[] = {
    {"bunny", bunny, "accuracy and time beside Embree's (4096-ray reference)"},
    {"resolution", resolution, "error over the occluder map's resolution (Soft Shadow Maps, Fig. 17)"},
    {"light_size", light_size, "error and time over the light's size (Figs. 18, 24)"},
    {"lateral", lateral, "error as the occluder moves sideways (Fig. 19)"},
    {"vertical", vertical, "error as the occluder moves towards the light (Fig. 20)"},
    {"texels", texels, "time over the number of occluder texels (Fig. 22)"},
    {"accumulators", accumulators, "binary16, binary32, compensated (Fig. 14, Appendix A)"},
    {"baselines", baselines, "shadow maps: hard, percentage-closer, bicubic"},
    {"large", large, "4096 x 4096 receivers, 2048 x 2048 occluders"},
    {"wedges", wedges, "soft_shadow_volume: overlap, light splits, spheres, beside Embree's"},
    {"wedge_culling", wedge_culling, "soft_shadow_volume: what each culling spares (Papers II and IV); the light's size"},
    {"wedge_models", wedge_models, "soft_shadow_volume on five meshes, beside soft_shadow_map and Embree's"},
    {"wedge_silhouettes", wedge_silhouettes, "soft_shadow_volume: silhouettes from each receiver beside the light's centre's and rays"},
    {"wedge_growth", wedge_growth, "soft_shadow_volume: time over silhouette edges, and over receivers"},
    {"occlusion", occlusion, "occlusion_texture: its settings, beside the other techniques and Embree's"},
    {"occlusion_filters", occlusion_filters, "N-buffers, mip-maps, summed-area tables: error, roughness, bandwidth (Fig. 2)"},
    {"occlusion_light", occlusion_light, "occlusion_texture: error and time over the light's size; the sun"},
    {"occlusion_casters", occlusion_casters, "occlusion_texture: time over triangles and bunnies (Figs. 12, 13)"},
    {"occlusion_sheet", occlusion_sheet, "occlusion_texture: a tilted sheet in 4 to 64 slices"},
    {"smoothies", smoothies, "smoothie: Table 1 of its paper, beside shadow maps; its width t"},
    {"smoothie_light_size", smoothie_light_size, "smoothie: error over the light's size, beside soft_shadow_map (Fig. 8)"},
    {"estimates", estimates, "the report's error estimates of the suite's scenes beside their errors"},
    {"suite", suite, "eleven scenes by several settings and by rays; after it: kind:key=value,key=value for these alone"},
    {"image_io", image_io, "images read and written, beside OpenImageIO"},
    {"limits", limits, "the device's limits, and what the inner loop reaches"},
};

int usage()
{
    std::fputs("usage: penumbra_bench BENCH...\n", stderr);
    for (const Case& c : cases) std::fprintf(stderr, "  %-20s %s\n", c.name, c.meaning);
    return 2;
}

} // namespace

int main(int argc, char** argv)
{
    if (argc < 2) return usage();
    try {
        const penumbra::Engine engine;
        print_engine(engine);
        print_header();
        for (int i = 1; i < argc; ++i)
            if (std::strchr(argv[i], ':')) suite_settings().emplace_back(argv[i]);
        for (int i = 1; i < argc; ++i) {
            bool known = std::strchr(argv[i], ':') != nullptr;
            for (const Case& c : cases)
                if (std::strcmp(c.name, argv[i]) == 0) {
                    c.run(engine);
                    known = true;
                }
            if (!known) return usage();
        }
    } catch (const penumbra::Error& error) {
        std::fprintf(stderr, "penumbra_bench: %s\n", error.what());
        return penumbra::exit_code(error.code());
    }
    return 0;
}
