#include "scene/depth.hpp"
#include "scene/stored_depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

constexpr double furthest_depth = 1e12; // as the largest number of a scene

std::string number(double value)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

void check_range(const DepthEncoding& encoding, const std::string& where)
{
    if (!in_unit_range(encoding.kind)) return;
    const bool infinite_far = encoding.kind == EncodingKind::reversed_window && !encoding.far;
    if (!encoding.near || (!encoding.far && !infinite_far))
        throw Error(ErrorCode::invalid_input, where + ": encoding needs near and far",
                    "expected two lengths; far may be left out of reversed_window alone, where it then is infinite");
    const double lowest = encoding.kind == EncodingKind::normalized ? 0 : std::nextafter(0.0, 1.0);
    const bool either_way = encoding.kind == EncodingKind::normalized; // white may be near
    const bool apart = !encoding.far || *encoding.near < *encoding.far || (either_way && *encoding.near > *encoding.far);
    if (!(std::isfinite(*encoding.near) && *encoding.near >= lowest) ||
        (encoding.far && !(apart && *encoding.far >= lowest && std::isfinite(*encoding.far))))
        throw Error(ErrorCode::invalid_input,
                    where + ": encoding has near " + number(*encoding.near) + " and far " + (encoding.far ? number(*encoding.far) : "infinite"),
                    either_way ? "expected two lengths that differ, 0 or more" : "expected 0 < near < far");
}

void check_type(const RawDepth& raw, const DepthEncoding& encoding, const std::string& where, std::vector<std::string>& warnings)
{
    if (raw.type == SampleType::uint8 && !in_unit_range(encoding.kind) && encoding.kind != EncodingKind::disparity)
        throw Error(ErrorCode::invalid_input, where + " is 8-bit; depth needs 16-bit or float",
                    "use EXR float32, or encoding \"normalized\" with near and far");
    if (raw.type == SampleType::uint8) warnings.push_back(where + " is 8-bit: 256 depths at most, shadows will show steps");
    if (raw.type == SampleType::float16)
        warnings.push_back(where + " is half-float: depth is right to 1 part in 2048 at best; float32 is better");
}

// Depth, in the encoding's own measure, of a stored value that is there. `value` is 0 to 1 for the kinds that say so.
double decode(double value, const DepthEncoding& encoding)
{
    const double near = encoding.near.value_or(0);
    const double inverse_far = encoding.far ? 1 / *encoding.far : 0;
    switch (encoding.kind) {
    case EncodingKind::planar:
    case EncodingKind::radial:
        return value;
    case EncodingKind::disparity:
        return encoding.shift ? 1 / (value * encoding.scale + *encoding.shift) : 1 / value;
    case EncodingKind::window:
        return 1 / (1 / near + value * (inverse_far - 1 / near));
    case EncodingKind::reversed_window:
        return 1 / (inverse_far + value * (1 / near - inverse_far));
    case EncodingKind::normalized:
        return near + value * (*encoding.far - near);
    }
    return value;
}

// Half a unit in the last place of what was stored, as a relative error of the depth, at its worst.
double precision_of(const RawDepth& raw, const DepthEncoding& encoding)
{
    if (raw.type == SampleType::float16) return 0x1p-11;
    if (!is_integer(raw.type)) return 0x1p-24;
    const double step = 0.5 / (in_unit_range(encoding.kind) ? largest_integer(raw.type) : 1);
    double worst = 0x1p-24;
    for (const float stored : raw.samples) {
        if (is_empty(stored, raw, encoding)) continue;
        const double value = unit_value(stored, raw.type, encoding.kind);
        const double here = decode(value, encoding);
        const double there = decode(value + (value > step ? -step : step), encoding);
        if (here != 0 && std::isfinite(there)) worst = std::max(worst, std::abs((there - here) / here));
    }
    return worst;
}

// How far apart the depths of neighbouring stored numbers are.
DepthStep step_of(const RawDepth& raw, const DepthEncoding& encoding)
{
    DepthStep step;
    const double scale = std::abs(encoding.scale);
    if (raw.type == SampleType::float16) {
        step.mantissa_bits = 10;
        step.unit = encoding.kind == EncodingKind::planar ? scale : 1;
    }
    if (!is_integer(raw.type)) return step;
    const double unit = in_unit_range(encoding.kind) ? 1 / largest_integer(raw.type) : 1;
    const double inverse_far = encoding.far ? 1 / *encoding.far : 0;
    switch (encoding.kind) {
    case EncodingKind::planar:
    case EncodingKind::radial: step.depth = unit * scale; break;
    case EncodingKind::normalized: step.depth = unit * scale * std::abs(*encoding.far - *encoding.near); break;
    case EncodingKind::disparity: step.disparity = encoding.shift ? unit * scale : unit / scale; break;
    case EncodingKind::window:
    case EncodingKind::reversed_window: step.disparity = unit * std::abs(1 / *encoding.near - inverse_far) / scale; break;
    }
    return step;
}

// What the map says of itself beside its depths.
DepthMap map_of(const RawDepth& raw, const DepthEncoding& encoding, double precision)
{
    return {.width = raw.width,
            .height = raw.height,
            .depth = {},
            .precision = precision,
            .from_image = true,
            .noise = encoding.precision.value_or(0),
            .step = step_of(raw, encoding)};
}

} // namespace

namespace {

// Values of which the sign is wrong, where others are depth: one marker alone means nothing there, several are a program's mistake or ours.
void warn_of_other_sign(const RawDepth& raw, const DepthEncoding& encoding, const std::string& at, std::vector<std::string>& warnings)
{
    const float sign = is_flipped(encoding) ? -1 : 1;
    std::size_t count = 0;
    float least = 0, greatest = -std::numeric_limits<float>::max();
    for (const float stored : raw.samples) {
        const float value = stored * sign;
        if (!(value < 0) || !std::isfinite(value)) continue;
        ++count;
        least = std::min(least, value);
        greatest = std::max(greatest, value);
    }
    if (count == 0 || least == greatest) return;
    warnings.push_back(at + ": " + std::to_string(count) + (sign < 0 ? " values are positive" : " values are negative") + " (down to " +
                       number(least * sign) + ") and count as nothing there; what stands for that, encoding.empty can say");
}

// Depth may be missing everywhere, but not because its sign is wrong.
void check_sign(const RawDepth& raw, const DepthEncoding& encoding, const std::string& at, std::vector<std::string>& warnings)
{
    if (encoding.empty) return; // a sign that is wrong is an error of its own
    const bool flipped = is_flipped(encoding);
    const auto other_sign = [&](float stored) { return std::isfinite(stored) && (flipped ? stored > 0 : stored < 0); };
    if (std::ranges::none_of(raw.samples, other_sign)) return;
    if (std::ranges::any_of(raw.samples, [&](float stored) { return !is_empty(stored, raw, encoding); }))
        return warn_of_other_sign(raw, encoding, at, warnings);
    throw Error(ErrorCode::invalid_input, at + " holds no depth, its values are " + (flipped ? "positive: " : "negative: ") + values_text(raw),
                flipped ? "expected negative values with a negative scale"
                        : "a program that writes camera-space z needs \"scale\": -1 in its encoding; if they mean nothing there, set \"empty\"");
}

// Planar depth is what is wanted: nothing but what means nothing there is replaced. As is_empty says, for every sample at once.
void replace_empty(std::vector<float>& samples, SampleType type)
{
    const float end = is_integer(type) ? std::numeric_limits<float>::infinity() : far_end(type);
    for (float& stored : samples) stored = stored > 0 && stored < end ? stored : nothing_there;
}

// Distance to the camera's centre over planar depth, at each pixel.
struct RadialStretch {
    int width, height;
    Vec2 half_extent, center;

    double at(std::size_t i) const
    {
        const auto column = static_cast<double>(i % static_cast<std::size_t>(width)), row = static_cast<double>(i / static_cast<std::size_t>(width));
        const double x = (2 * (column + 0.5) / width - 1) * half_extent.x + center.x;
        const double y = (1 - 2 * (row + 0.5) / height) * half_extent.y + center.y;
        return std::sqrt(1 + x * x + y * y);
    }
};

} // namespace

DepthMap decode_depth(RawDepth raw, const DepthEncoding& given, const Vec2& half_extent, std::string_view where,
                      std::vector<std::string>& warnings, const Vec2& center)
{
    const std::string at(where);
    check_range(given, at);
    check_type(raw, given, at, warnings);
    if (given.scale == 0 || !std::isfinite(given.scale))
        throw Error(ErrorCode::invalid_input, at + ": encoding.scale is " + number(given.scale), "expected a number that is not 0");
    const DepthEncoding encoding = solved(given, raw, at, warnings);
    check_sign(raw, encoding, at, warnings);

    DepthMap map = map_of(raw, encoding, precision_of(raw, encoding));
    if (encoding.kind == EncodingKind::planar && encoding.scale == 1 && !encoding.empty) {
        replace_empty(raw.samples, raw.type);
        map.depth = std::move(raw.samples);
        return map;
    }

    map.depth.reserve(raw.samples.size());
    const RadialStretch stretch{raw.width, raw.height, half_extent, center};
    std::size_t beyond = 0, there = 0;
    for (std::size_t i = 0; i < raw.samples.size(); ++i) {
        const float stored = raw.samples[i];
        if (is_empty(stored, raw, encoding)) {
            map.depth.push_back(nothing_there);
            continue;
        }
        ++there;
        const double value = unit_value(stored, raw.type, encoding.kind);
        if (in_unit_range(encoding.kind) && (value < 0 || value > 1))
            throw Error(ErrorCode::invalid_input, at + ": has a stored value of " + number(value), "expected 0 to 1 in this encoding");
        double depth = decode(value, encoding) * (encoding.shift ? 1 : encoding.scale);
        if (encoding.kind == EncodingKind::radial) depth /= stretch.at(i);
        // What a scale and a shift put behind infinity is as far away as nothing.
        if (encoding.shift && !(depth > 0 && std::isfinite(depth))) {
            ++beyond;
            depth = nothing_there;
        }
        if (!(depth > 0))
            throw Error(ErrorCode::invalid_input, at + ": a stored value of " + number(stored) + " decodes to depth " + number(depth),
                        stored < 0 ? "expected positive depths; camera-space z needs a negative scale" : "expected positive depths; check the encoding");
        if (depth < std::numeric_limits<float>::min())
            throw Error(ErrorCode::invalid_input, at + ": a stored value of " + number(stored) + " decodes to depth " + number(depth),
                        "expected depths that binary32 holds; check the encoding");
        // A disparity may stand for any depth: as far away as nothing.
        map.depth.push_back(depth > furthest_depth ? nothing_there : static_cast<float>(depth));
    }
    if (beyond > 0 && beyond == there)
        throw Error(ErrorCode::invalid_input, at + ": every value x scale + shift is 0 or less: " + values_text(raw),
                    "expected disparities, 1 / depth; check encoding.scale and encoding.shift");
    if (beyond > 0)
        warnings.push_back(at + ": value x scale + shift is 0 or less at " + std::to_string(beyond) + " of " + std::to_string(there) +
                           " pixels, which count as nothing there");
    return map;
}

} // namespace penumbra
