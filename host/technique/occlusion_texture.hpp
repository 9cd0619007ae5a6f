// Occlusion textures (Eisemann, Decoret 2008): settings become device state, device state becomes masks.
#pragma once

#include <string>
#include <vector>

#include "scene/camera.hpp"
#include "technique/occlusion_slices.hpp"
#include "technique/receiver_points.hpp"
#include "technique/table.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

struct PreparedOcclusionTexture {
    // What one part of the light needs.
    struct Part {
        OcclusionLight light{};
        opencl::Buffer<OcclusionPlane> planes;
        opencl::Buffer<OcclusionLevel> levels;
        opencl::Buffer<cl_uchar> data; // levels, or tables
    };
    OcclusionTexture settings;
    opencl::Specialisation program;
    Camera view; // that receivers are to come in
    std::vector<Part> parts;
    std::vector<std::string> warnings, notes;
};

// `meshes`: the surfaces that cast, in world space; `receivers_cast`: whether a receiver may lie on them. Throws invalid_input for settings that do not go together or with the light, too_large
// with what would fit for more slices or texels than the device's memory holds.
PreparedOcclusionTexture prepare_occlusion_texture(opencl::Work& work, const Light& light, std::span<const TriangleMesh* const> meshes,
                                                   const SolidMaps* solid, const OcclusionTexture& settings, bool receivers_cast = true);

// Writes visibility, receivers.view.height x receivers.view.width. `counts`, if any, takes the lookups as pairs.
void shade_occlusion_texture(opencl::Work& work, const PreparedOcclusionTexture& prepared, const ReceiverPoints& receivers,
                             const cl::Buffer& visibility, ShadeCounts* counts);

// The verbs (verbs.hpp).
TechniqueRow row(const OcclusionTexture&);
Needs needs(const OcclusionTexture&);
PreparedOcclusionTexture prepare(opencl::Work& work, const Casting& casting, const OcclusionTexture& settings, Findings& findings);
void shade(opencl::Work& work, const PreparedOcclusionTexture& prepared, const Receiving& receivers, Shaded& shaded);
std::vector<WorkAmount> work(const OcclusionTexture& settings, const MaskShape& shape);
std::vector<opencl::Specialisation> specialisations(const OcclusionTexture& settings, int lanes);
DeviceBuffers device_buffers(const OcclusionTexture& settings);
void check_together(const OcclusionTexture& settings);

} // namespace penumbra
