// Shadow rays through the scene's objects: the reference, on the host's cores.
#pragma once

#include <memory>

#include <penumbra/technique.hpp>

#include "technique/table.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

struct PreparedRays {
    RayTraced settings;
    Light light;
    std::shared_ptr<const Tracer> casters;
    std::vector<std::shared_ptr<const DepthImage>> images;
};

// The verbs (verbs.hpp).
TechniqueRow row(const RayTraced&);
Needs needs(const RayTraced&);
PreparedRays prepare(opencl::Work& work, const Casting& casting, const RayTraced& settings, Findings& findings);
void shade(opencl::Work& work, const PreparedRays& prepared, const Receiving& receivers, Shaded& shaded);
std::vector<WorkAmount> work(const RayTraced& settings, const MaskShape& shape);
std::vector<opencl::Specialisation> specialisations(const RayTraced& settings, int lanes);
DeviceBuffers device_buffers(const RayTraced& settings);
PreparedRays with_emission(opencl::Work& work, const PreparedRays& prepared, const Light& light);

} // namespace penumbra
