#include "opencl/specialisation.hpp"

namespace penumbra::opencl {

std::string Specialisation::options() const
{
    std::string text;
    for (const auto& [name, value] : constants) {
        if (!text.empty()) text += ' ';
        text += "-D" + name + '=' + value;
    }
    return text;
}

} // namespace penumbra::opencl
