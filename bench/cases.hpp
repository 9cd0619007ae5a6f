// The benches. Each prints rows (CSV) to standard output.
#pragma once

#include <string>
#include <vector>

#include <penumbra/penumbra.hpp>

namespace penumbra::bench {

void bunny(const Engine& engine);               // accuracy and time beside Embree's, at several map resolutions and ray counts
void resolution(const Engine& engine);          // Fig. 17: error over the occluder map's resolution
void light_size(const Engine& engine);          // Figs. 18 and 24: error and time over the light's size
void lateral(const Engine& engine);             // Fig. 19: error as the occluder moves sideways
void vertical(const Engine& engine);            // Fig. 20: error as the occluder moves from the receiver to the light
void texels(const Engine& engine);              // Fig. 22: time over the number of occluder texels
void accumulators(const Engine& engine);        // Fig. 14, Appendix A: binary16, binary32, compensated
void baselines(const Engine& engine);           // shadow maps: hard, percentage-closer, bicubic
void large(const Engine& engine);               // 4096 x 4096 receivers, 2048 x 2048 occluders
void wedges(const Engine& engine);              // soft_shadow_volume: overlap, splits, spheres, beside rays
void wedge_culling(const Engine& engine);       // what each culling spares; the light's size
void wedge_models(const Engine& engine);        // soft_shadow_volume on several meshes beside soft_shadow_map and rays
void wedge_silhouettes(const Engine& engine);   // soft_shadow_volume with silhouettes from each receiver, on meshes, light sizes, triangles
void wedge_growth(const Engine& engine);        // its time over silhouette edges and over receivers
void occlusion(const Engine& engine);           // occlusion_texture: slices, resolution, filters, combination, placement, beside rays
void occlusion_filters(const Engine& engine);   // its three filters: error, roughness, build and bandwidth (Fig. 2)
void occlusion_light(const Engine& engine);     // its time over the light's size; the sun
void occlusion_casters(const Engine& engine);   // its time over triangles (Figs. 12 and 13)
void occlusion_sheet(const Engine& engine);     // a tilted sheet: more slices make the product worse
void smoothies(const Engine& engine);           // smoothie over buffers, triangles and widths, beside shadow maps
void smoothie_light_size(const Engine& engine); // its error over the light's size
void image_io(const Engine& engine);            // images from and to bytes beside OpenImageIO
void suite(const Engine& engine);               // eleven scenes by several settings and by rays, 4096-ray references
std::vector<std::string>& suite_settings();     // those of the suite, "kind:key=value,key=value"; empty: the usual ones
void estimates(const Engine& engine);           // Report::error_estimate of the suite's scenes beside the error that it is of
void limits(const Engine& engine);              // the device's arithmetic and memory limits, and what the inner loop reaches

// GB/s read and written by a kernel that copies 256 MiB.
double copy_rate(const Engine& engine);

} // namespace penumbra::bench
