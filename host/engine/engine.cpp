#include <penumbra/engine.hpp>

#include <penumbra/error.hpp>

#include "engine/depth_sources.hpp"
#include "engine/geometry.hpp"
#include "engine/impl.hpp"
#include "engine/state.hpp"

namespace penumbra {

Engine::Engine() : impl_(std::make_unique<Impl>(opencl::Context::open({}))) {}
Engine::Engine(const std::string& selector) : impl_(std::make_unique<Impl>(opencl::Context::open(selector))) {}
Engine::Engine(cl_context context, cl_device_id device) : impl_(std::make_unique<Impl>(opencl::Context::wrap(context, device))) {}
Engine::~Engine() = default;
Engine::Engine(Engine&&) noexcept = default;
Engine& Engine::operator=(Engine&&) noexcept = default;

const DeviceInfo& Engine::device() const { return impl_->context->info(); }

Mask Engine::mask(const Scene& scene) const { return mask(scene, technique_from(scene.technique)); }

Mask Engine::mask(const Scene& scene, const Technique& technique) const
{
    const Stopwatch total;
    const Geometry geometry = view_of(scene);
    const Prepared prepared = prepare(scene.light, scene.occluders, geometry, technique);

    const Stopwatch render;
    const Receivers receivers = with_depth(scene.receivers, scene.light, geometry);
    const Stage rendered{"render depth", render.ms(), 0, 0};

    Mask mask = shade(prepared, receivers);
    std::vector<Stage> stages{rendered};
    add_stages(stages, prepared.state().stages);
    add_stages(stages, mask.report.stages);
    mask.report.stages = std::move(stages);
    mask.report.prepare_ms = prepared.state().prepare_ms;
    mask.report.warnings.insert(mask.report.warnings.begin(), scene.warnings.begin(), scene.warnings.end());
    mask.report.total_ms = total.ms();
    return mask;
}

void check_device_buffer(cl_mem buffer, int width, int height, const char* what)
{
    if (!buffer || width < 1 || height < 1)
        throw Error(ErrorCode::usage, std::string(what) + ": is null or has no size", "expected a buffer of width * height floats");
    check_pixels(width, height, what);
    std::size_t bytes = 0;
    const std::size_t needed = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * sizeof(float);
    if (clGetMemObjectInfo(buffer, CL_MEM_SIZE, sizeof(bytes), &bytes, nullptr) != CL_SUCCESS || bytes < needed)
        throw Error(ErrorCode::usage, std::string(what) + ": holds " + std::to_string(bytes) + " bytes",
                    "expected at least " + std::to_string(needed) + ": width * height floats");
}

} // namespace penumbra
