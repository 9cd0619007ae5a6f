#include "scene/stored_depth.hpp"

#include <cmath>
#include <cstdio>
#include <limits>

namespace penumbra {

ImageFrame frame_of(const RawDepth& raw) { return raw.frame.width > 0 ? raw.frame : ImageFrame{0, 0, raw.width, raw.height}; }

RawDepth framed(RawDepth raw)
{
    const ImageFrame frame = frame_of(raw);
    if (frame.x == 0 && frame.y == 0 && frame.width == raw.width && frame.height == raw.height) return raw;
    RawDepth result{
        .width = frame.width, .height = frame.height, .type = raw.type, .samples = {}, .frame = {}, .pixel_aspect = raw.pixel_aspect};
    const auto width = static_cast<std::size_t>(frame.width);
    result.samples.assign(width * static_cast<std::size_t>(frame.height), std::numeric_limits<float>::quiet_NaN());

    // Rows and columns that both have.
    const int first = std::max(frame.x, 0), end = static_cast<int>(std::min<std::int64_t>(std::int64_t{frame.x} + frame.width, raw.width));
    const int top = std::max(frame.y, 0),
              bottom = static_cast<int>(std::min<std::int64_t>(std::int64_t{frame.y} + frame.height, raw.height));
    for (int y = top; y < bottom && first < end; ++y) {
        const float* const row = raw.samples.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(raw.width);
        std::copy(row + first, row + end,
                  &result.samples[static_cast<std::size_t>(y - frame.y) * width + static_cast<std::size_t>(first - frame.x)]);
    }
    return result;
}

bool is_empty(float stored, const RawDepth& raw, const DepthEncoding& encoding)
{
    if (!std::isfinite(stored)) return true;
    if (encoding.empty) return stored == static_cast<float>(*encoding.empty);
    const float value = is_flipped(encoding) ? -stored : stored;
    if (value <= 0 || (!is_integer(raw.type) && value >= far_end(raw.type))) return true;
    // A cleared depth buffer holds its far end: 1, or 0 where it is reversed.
    return encoding.kind == EncodingKind::window && unit_value(stored, raw.type, encoding.kind) == 1;
}

std::string values_text(const RawDepth& raw)
{
    std::size_t negative = 0, zero = 0, infinite = 0;
    float least = std::numeric_limits<float>::max(), greatest = -std::numeric_limits<float>::max();
    for (const float stored : raw.samples) {
        if (!std::isfinite(stored)) {
            ++infinite;
            continue;
        }
        negative += stored < 0;
        zero += stored == 0;
        least = std::min(least, stored);
        greatest = std::max(greatest, stored);
    }
    std::string text = std::to_string(raw.samples.size()) + " values";
    char range[80];
    std::snprintf(range, sizeof range, " from %.6g to %.6g", static_cast<double>(least), static_cast<double>(greatest));
    if (least <= greatest) text += range;
    return text + ", " + std::to_string(negative) + " negative, " + std::to_string(zero) + " zero, " + std::to_string(infinite) +
           " infinite or no number";
}

} // namespace penumbra
