#include "scene/depth.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

constexpr float far_away = 1e9f;         // at and above this a stored value means nothing there (docs/scene_file.md, encoding)
constexpr float half_far_away = 65504.f; // the largest half-float

bool in_unit_range(EncodingKind kind)
{
    return kind == EncodingKind::window || kind == EncodingKind::reversed_window || kind == EncodingKind::normalized;
}

bool is_integer(SampleType type) { return type == SampleType::uint8 || type == SampleType::uint16 || type == SampleType::uint32; }

double largest_integer(SampleType type) { return type == SampleType::uint8 ? 255.0 : type == SampleType::uint16 ? 65535.0 : 4294967295.0; }

void check_range(const DepthEncoding& encoding, const std::string& where)
{
    if (!in_unit_range(encoding.kind)) return;
    const bool infinite_far = encoding.kind == EncodingKind::reversed_window && !encoding.far;
    if (!encoding.near || (!encoding.far && !infinite_far))
        throw Error(ErrorCode::invalid_input, where + ": encoding needs near and far",
                    "expected two lengths; far may be left out of reversed_window alone, where it then is infinite");
    const double lowest = encoding.kind == EncodingKind::normalized ? 0 : std::nextafter(0.0, 1.0);
    if (!(std::isfinite(*encoding.near) && *encoding.near >= lowest) ||
        (encoding.far && !(*encoding.near < *encoding.far && std::isfinite(*encoding.far))))
        throw Error(ErrorCode::invalid_input,
                    where + ": encoding has near " + std::to_string(*encoding.near) + " and far " +
                        (encoding.far ? std::to_string(*encoding.far) : "infinite"),
                    "expected 0 < near < far");
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

bool is_empty(float stored, const RawDepth& raw, const DepthEncoding& encoding)
{
    if (encoding.empty) return stored == static_cast<float>(*encoding.empty) || !std::isfinite(stored);
    const float limit = raw.type == SampleType::float16 ? half_far_away : far_away;
    return !std::isfinite(stored) || stored <= 0 || (!is_integer(raw.type) && stored >= limit);
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
        const double value = in_unit_range(encoding.kind) ? stored / largest_integer(raw.type) : stored;
        const double here = decode(value, encoding);
        const double there = decode(value + (value > step ? -step : step), encoding);
        if (here > 0 && std::isfinite(there)) worst = std::max(worst, std::abs(there - here) / here);
    }
    return worst;
}

} // namespace

namespace {

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

DepthMap decode_depth(RawDepth raw, const DepthEncoding& encoding, const Vec2& half_extent, std::string_view where,
                      std::vector<std::string>& warnings)
{
    const std::string at(where);
    check_range(encoding, at);
    check_type(raw, encoding, at, warnings);
    if (!(encoding.scale > 0) || !std::isfinite(encoding.scale))
        throw Error(ErrorCode::invalid_input, at + ": encoding.scale is " + std::to_string(encoding.scale), "expected a positive number");

    // Planar depth is what is wanted: nothing but what means nothing there is replaced. As is_empty says, for every sample at once.
    if (encoding.kind == EncodingKind::planar && encoding.scale == 1 && !encoding.empty) {
        DepthMap map = map_of(raw, encoding, precision_of(raw, encoding));
        const float end = is_integer(raw.type)              ? std::numeric_limits<float>::infinity()
                          : raw.type == SampleType::float16 ? half_far_away
                                                            : far_away;
        for (float& stored : raw.samples) stored = stored > 0 && stored < end ? stored : nothing_there;
        map.depth = std::move(raw.samples);
        return map;
    }

    DepthMap map = map_of(raw, encoding, precision_of(raw, encoding));
    map.depth.reserve(raw.samples.size());
    std::size_t on_far_plane = 0;
    for (std::size_t i = 0; i < raw.samples.size(); ++i) {
        const float stored = raw.samples[i];
        if (is_empty(stored, raw, encoding)) {
            map.depth.push_back(nothing_there);
            continue;
        }
        const double value = in_unit_range(encoding.kind) && is_integer(raw.type) ? stored / largest_integer(raw.type) : stored;
        if (in_unit_range(encoding.kind) && (value < 0 || value > 1))
            throw Error(ErrorCode::invalid_input, at + ": has a stored value of " + std::to_string(value),
                        "expected 0 to 1 in this encoding");
        on_far_plane += encoding.kind == EncodingKind::window && value == 1;
        double depth = decode(value, encoding) * (encoding.shift ? 1 : encoding.scale);
        if (encoding.kind == EncodingKind::radial) {
            const double x = (2 * (static_cast<double>(i % static_cast<std::size_t>(raw.width)) + 0.5) / raw.width - 1) * half_extent.x;
            const double y = (1 - 2 * (static_cast<double>(i / static_cast<std::size_t>(raw.width)) + 0.5) / raw.height) * half_extent.y;
            depth /= std::sqrt(1 + x * x + y * y);
        }
        if (!(depth > 0))
            throw Error(ErrorCode::invalid_input,
                        at + ": a stored value of " + std::to_string(stored) + " decodes to depth " + std::to_string(depth),
                        "expected positive depths; check the encoding");
        // A disparity may stand for a depth beyond float32: as far away as nothing.
        map.depth.push_back(depth > std::numeric_limits<float>::max() ? nothing_there : static_cast<float>(depth));
    }
    if (on_far_plane > 0)
        warnings.push_back(at + ": " + std::to_string(on_far_plane) +
                           " pixels are exactly 1, the far plane; if that means nothing there, set \"empty\": 1 in its encoding");
    return map;
}

} // namespace penumbra
