#include <penumbra/engine.hpp>

#include <penumbra/error.hpp>

#include "engine/depth_sources.hpp"
#include "engine/impl.hpp"

namespace penumbra {

Engine::Engine() : Engine(std::string()) {}
Engine::Engine(const std::string& selector) : impl_(std::make_unique<Impl>(Impl{std::make_shared<const opencl::LateContext>(selector)})) {}
Engine::Engine(cl_context context, cl_device_id device) : impl_(std::make_unique<Impl>(Impl{std::make_shared<const opencl::LateContext>(opencl::Context::wrap(context, device))})) {}
Engine::~Engine() = default;
Engine::Engine(Engine&&) noexcept = default;
Engine& Engine::operator=(Engine&&) noexcept = default;

const DeviceInfo& Engine::device() const { return impl_->device->get()->info(); }

void check_device_buffer(cl_mem buffer, int width, int height, const char* what)
{
    if (!buffer || width < 1 || height < 1)
        throw Error::at(ErrorCode::usage, std::string(what), "is null or has no size", "expected a buffer of width * height floats");
    check_pixels(width, height, what);
    std::size_t bytes = 0;
    const std::size_t needed = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * sizeof(float);
    if (clGetMemObjectInfo(buffer, CL_MEM_SIZE, sizeof(bytes), &bytes, nullptr) != CL_SUCCESS || bytes < needed)
        throw Error::at(ErrorCode::usage, std::string(what), "holds " + std::to_string(bytes) + " bytes",
                        "expected at least " + std::to_string(needed) + ": width * height floats");
}

} // namespace penumbra
