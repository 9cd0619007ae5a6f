#include "io/raw_planes.hpp"

#include <cmath>
#include <string>

#include <penumbra/error.hpp>

namespace penumbra {

void check_frame(const ImageFrame& frame, std::string_view where, std::uint64_t max_samples)
{
    const std::string size = std::to_string(frame.width) + " x " + std::to_string(frame.height);
    constexpr int furthest = 1 << 30;
    if (frame.width < 1 || frame.height < 1 || std::abs(std::int64_t{frame.x}) > furthest || std::abs(std::int64_t{frame.y}) > furthest)
        throw Error(ErrorCode::invalid_input, std::string(where) + " has a display window of " + size + ", far away or empty");
    if (static_cast<std::uint64_t>(frame.width) > max_samples / static_cast<std::uint64_t>(frame.height))
        throw Error(ErrorCode::too_large,
                    std::string(where) + " has a display window of " + size + "; the limit is " + std::to_string(max_samples) + " samples");
}

double sound_aspect(double aspect)
{
    constexpr double most = 1000; // OpenEXR takes up to a million
    return aspect > 1 / most && aspect < most ? aspect : 1;
}

} // namespace penumbra
