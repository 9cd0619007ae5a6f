#include "scene/cut_out.hpp"

#include <algorithm>
#include <cmath>

namespace penumbra {
namespace {

// The texel that stands for number `i` of an axis of `size` texels; whole numbers of any size come in as double.
int texel(double i, int size, CutOut::Beyond beyond)
{
    if (beyond == CutOut::Beyond::clamp) return static_cast<int>(std::clamp(i, 0.0, size - 1.0));
    const double period = beyond == CutOut::Beyond::repeat ? size : 2.0 * size;
    const double rest = std::clamp(i - std::floor(i / period) * period, 0.0, period - 1);
    return static_cast<int>(rest < size ? rest : period - 1 - rest);
}

} // namespace

float alpha_at(const CutOut& cut, const Imath::V2f& at)
{
    const Image& image = cut.alpha;
    // No texture coordinates mean nothing: the surface is there.
    if (!std::isfinite(at.x) || !std::isfinite(at.y)) return std::numeric_limits<float>::infinity();
    const double x = double{at.x} * image.width, y = double{at.y} * image.height;
    const auto value = [&](double i, double j) {
        return image.at(texel(i, image.width, cut.beyond_u), texel(j, image.height, cut.beyond_v));
    };
    if (cut.nearest) return value(std::floor(x), std::floor(y));

    // Between the middles of four texels.
    const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
    const auto right = static_cast<float>(x - 0.5 - left), down = static_cast<float>(y - 0.5 - top);
    const float upper = std::lerp(value(left, top), value(left + 1, top), right);
    const float lower = std::lerp(value(left, top + 1), value(left + 1, top + 1), right);
    return std::lerp(upper, lower, down);
}

} // namespace penumbra
