// Shadow rays walked through depth images, on the OpenCL device.
#pragma once

#include <memory>
#include <vector>

#include <penumbra/technique.hpp>

#include "depth_image/depth_image.hpp"
#include "technique/table.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

// A depth image on the device.
struct DeviceDepthImage {
    Camera camera;
    DepthView view;
    opencl::Buffer<DepthPixel> pixels;
    opencl::Buffer<float> nearest;
};

struct PreparedDepthTrace {
    DepthTrace settings;
    opencl::Specialisation program;
    Light light;
    std::shared_ptr<const std::vector<DeviceDepthImage>> images;
    opencl::Buffer<cl_float2> strata; // low corners
    cl_float2 step{};                 // 2^-16 of a stratum
    int samples = 0;
};

// The verbs (verbs.hpp).
TechniqueRow row(const DepthTrace&);
Needs needs(const DepthTrace&);
PreparedDepthTrace prepare(opencl::Work& work, const Casting& casting, const DepthTrace& settings, Findings& findings);
void shade(opencl::Work& work, const PreparedDepthTrace& prepared, const Receiving& receivers, Shaded& shaded);
std::vector<WorkAmount> work(const DepthTrace& settings, const MaskShape& shape);
std::vector<opencl::Specialisation> specialisations(const DepthTrace& settings, int lanes);
DeviceBuffers device_buffers(const DepthTrace& settings);

} // namespace penumbra
