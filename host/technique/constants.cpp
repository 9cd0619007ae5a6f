#include "technique/constants.hpp"

namespace penumbra {

opencl::Specialisation ReceiversConstants::specialisation() const { return {"receivers.cl", {{"TILE_ROWS", std::to_string(rows)}}}; }

opencl::Specialisation OccludersConstants::specialisation() const { return {"occluders.cl", {}}; }

opencl::Specialisation ShadowMapConstants::specialisation() const { return {"shadow_map.cl", {{"TILE_ROWS", std::to_string(rows)}}}; }

opencl::Specialisation SoftShadowMapConstants::specialisation() const
{
    return {"soft_shadow_map.cl",
            {{"LANES", std::to_string(lanes)},
             {"ITEM_ROWS", std::to_string(item_rows)},
             {"TILE_ROWS", std::to_string(rows)},
             {"ACCUMULATOR", std::to_string(accumulator)}}};
}

opencl::Specialisation SoftShadowVolumeConstants::specialisation() const
{
    return {"soft_shadow_volume.cl",
            {{"LANES", std::to_string(lanes)},
             {"ITEM_ROWS", std::to_string(item_rows)},
             {"TILE_ROWS", std::to_string(rows)},
             {"LIGHT", std::to_string(light)},
             {"COVERAGE", std::to_string(coverage)},
             {"CHANNELS", std::to_string(channels)},
             {"LOOKUP", std::to_string(lookup)},
             {"ACCUMULATOR", std::to_string(accumulator)}}};
}

opencl::Specialisation OcclusionTextureConstants::specialisation() const
{
    return {"occlusion_texture.cl",
            {{"LANES", std::to_string(lanes)},
             {"TILE_ROWS", std::to_string(rows)},
             {"PREFILTER", std::to_string(prefilter)},
             {"STORAGE", std::to_string(storage)}}};
}

opencl::Specialisation SmoothieConstants::specialisation() const
{
    return {"smoothie.cl", {{"LANES", std::to_string(lanes)}, {"TILE_ROWS", std::to_string(rows)}}};
}

std::vector<opencl::Specialisation> every_specialisation()
{
    std::vector<opencl::Specialisation> all{ReceiversConstants{}.specialisation(), OccludersConstants{}.specialisation(),
                                            ShadowMapConstants{}.specialisation()};
    for (const int lanes : {1, 8, 16})
        for (const int accumulator : {0, 1, 2})
            all.push_back(SoftShadowMapConstants{.lanes = lanes, .item_rows = lanes == 1 ? 1 : tile_rows, .accumulator = accumulator}
                              .specialisation());
    for (const int lanes : {1, 8, 16})
        for (const int light : {0, 1})
            for (const int accumulator : {0, 1, 2, 3})
                all.push_back(SoftShadowVolumeConstants{
                    .lanes = lanes, .item_rows = lanes == 1 ? 1 : tile_rows, .light = light, .accumulator = accumulator}
                                  .specialisation());
    // Linear coverage takes every light for a sphere.
    for (const int lanes : {1, 8, 16})
        for (const int accumulator : {0, 1, 2, 3})
            all.push_back(SoftShadowVolumeConstants{
                .lanes = lanes, .item_rows = lanes == 1 ? 1 : tile_rows, .light = 0, .coverage = 0, .accumulator = accumulator}
                              .specialisation());
    for (const int lanes : {1, 8, 16})
        for (const int prefilter : {0, 1, 2, 3})
            for (const int storage : {0, 1})
                if (prefilter != 2 || storage == 0)
                    all.push_back(OcclusionTextureConstants{.lanes = lanes, .prefilter = prefilter, .storage = storage}.specialisation());
    for (const int lanes : {1, 8, 16}) all.push_back(SmoothieConstants{.lanes = lanes}.specialisation());
    return all;
}

} // namespace penumbra
