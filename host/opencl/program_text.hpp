// The text that is compiled: constants, then the kernel file with its includes in place.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "opencl/specialisation.hpp"

namespace penumbra::opencl {

// The text of a file below kernels/, or nothing.
using FileLookup = std::function<std::optional<std::string_view>(std::string_view name)>;

// `#define` lines for the constants, then the file, where each `#include "..."` is replaced by that file (looked for beside the file that
// names it, then from kernels/) the first time, and by nothing after that. Kernels therefore include unconditionally, and include what only
// the host needs in angle brackets. #line directives keep the compiler's messages pointing at the kernel files. The constants stand in the
// text and not in -D options, because PoCL's cache has served stale programs for changed options. Throws internal for a file that is not
// there.
std::string program_text(const Specialisation& specialisation, const FileLookup& lookup);

// The same, from the embedded files.
std::string program_text(const Specialisation& specialisation);

} // namespace penumbra::opencl
