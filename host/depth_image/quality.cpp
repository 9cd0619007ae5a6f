#include "depth_image/quality.hpp"

#include <array>
#include <cstdio>

namespace penumbra {
namespace {

// From here on noise bends normals by more than a degree or two, and specks are to be expected.
constexpr double much_noise = 3e-3;

template <class... Values> std::string print(const char* format, Values... values)
{
    std::array<char, 400> text{};
    std::snprintf(text.data(), text.size(), format, values...);
    return text.data();
}

} // namespace

std::string quality_note(const DepthQuality& quality, const std::string& where)
{
    const int side = 2 * quality.reach + 1;
    std::string note = where + print(": noise %.1e of the depth, planes over %d x %d pixels", quality.noise, side, side);
    if (quality.step > 0) note += print(", stored in steps of %.1e of it", quality.step);
    note += print(", %.0f %% of the edges between two surfaces", 100 * quality.edge_share);
    if (quality.filled > 0 && !quality.smeared) note += print(", %llu pixels of holes closed", static_cast<unsigned long long>(quality.filled));
    return note;
}

std::vector<std::string> quality_warnings(const DepthQuality& quality, const std::string& where)
{
    std::vector<std::string> warnings;
    const auto between = static_cast<unsigned long long>(quality.between);
    if (quality.antialiased)
        warnings.push_back(where + print(": is anti-aliased: %llu pixels lie between two surfaces and cast nothing; depth without filtering is better", between));
    if (quality.smeared)
        warnings.push_back(where + print(": has smeared edges (a network's, a denoiser's, or upscaled): %llu pixels on them are replaced by the surfaces beside them", between));
    if (quality.noise > much_noise)
        warnings.push_back(where + print(": has noise of %.1e of the depth: shadows will show it", quality.noise));
    return warnings;
}

} // namespace penumbra
