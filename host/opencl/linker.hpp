// The linker that PoCL runs for each kernel.
#pragma once

#include <string>

namespace penumbra::opencl {

// Looked for where PoCL does: in the compiler's own folder, then on PATH. Empty: there is none.
const std::string& linker();

} // namespace penumbra::opencl
