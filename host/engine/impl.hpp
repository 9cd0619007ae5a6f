// The engine's inside.
#pragma once

#include <memory>

#include <penumbra/engine.hpp>

#include "opencl/context.hpp"

namespace penumbra {

struct Engine::Impl {
    std::shared_ptr<const opencl::LateContext> device;
};

// Throws usage unless the buffer is there and holds width * height floats.
void check_device_buffer(cl_mem buffer, int width, int height, const char* what);

} // namespace penumbra
