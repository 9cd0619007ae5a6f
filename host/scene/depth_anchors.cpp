// Scale and shift of a network's disparity from pixels of known depth.
#include <cmath>
#include <cstdio>

#include <penumbra/error.hpp>

#include "scene/stored_depth.hpp"

namespace penumbra {
namespace {

std::string text(const DepthAnchor& anchor) { return "[" + std::to_string(anchor.x) + ", " + std::to_string(anchor.y) + "]"; }

// What the image stores at an anchor.
double stored_at(const RawDepth& raw, const DepthEncoding& encoding, const DepthAnchor& anchor, const std::string& where)
{
    const ImageFrame frame = frame_of(raw);
    const std::int64_t x = anchor.x + frame.x, y = anchor.y + frame.y;
    if (x < 0 || y < 0 || x >= raw.width || y >= raw.height)
        throw Error(ErrorCode::invalid_input, where + ": encoding.anchors has the pixel " + text(anchor) + ", which lies beside the image",
                    "expected pixels of " + std::to_string(raw.width) + " x " + std::to_string(raw.height) + ", from [0, 0]");
    const float stored = raw.samples[static_cast<std::size_t>(y) * static_cast<std::size_t>(raw.width) + static_cast<std::size_t>(x)];
    if (is_empty(stored, raw, encoding))
        throw Error(ErrorCode::invalid_input, where + ": has nothing at the pixel " + text(anchor) + " of encoding.anchors",
                    "expected pixels that show a surface");
    return stored;
}

} // namespace

DepthEncoding solved(const DepthEncoding& encoding, const RawDepth& raw, const std::string& where, std::vector<std::string>& warnings)
{
    if (encoding.anchors.empty()) return encoding;

    // A line through (value, 1 / depth), from the means, so that no digits are lost.
    const auto count = static_cast<double>(encoding.anchors.size());
    std::vector<double> values;
    double mean = 0, mean_disparity = 0;
    for (const DepthAnchor& anchor : encoding.anchors) {
        values.push_back(stored_at(raw, encoding, anchor, where));
        mean += values.back() / count;
        mean_disparity += 1 / anchor.depth / count;
    }
    double square = 0, product = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        square += (values[i] - mean) * (values[i] - mean);
        product += (values[i] - mean) * (1 / encoding.anchors[i].depth - mean_disparity);
    }
    if (!(square > 0))
        throw Error(ErrorCode::invalid_input, where + ": stores the same value at every pixel of encoding.anchors",
                    "expected pixels of different depths");
    DepthEncoding result = encoding;
    result.scale = product / square;
    result.shift = mean_disparity - result.scale * mean;
    if (result.scale == 0 || !std::isfinite(result.scale) || !std::isfinite(*result.shift))
        throw Error(ErrorCode::invalid_input, where + ": encoding.anchors give one depth for every value",
                    "expected pixels of different depths");

    // How far the line is from the anchors, as a depth.
    double worst = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
        worst = std::max(worst, std::abs(encoding.anchors[i].depth * (values[i] * result.scale + *result.shift) - 1));
    char numbers[160];
    std::snprintf(numbers, sizeof numbers, "scale %.6g and shift %.6g; they miss the anchors' disparities by up to %.2g %%", result.scale,
                  *result.shift, 100 * worst);
    warnings.push_back(where + ": " + std::to_string(values.size()) + " anchors give " + numbers +
                       (result.scale < 0 ? "; the scale is negative, so greater values are further: is this disparity?" : ""));
    return result;
}

} // namespace penumbra
