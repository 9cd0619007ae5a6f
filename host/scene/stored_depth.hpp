// What a depth image's stored numbers stand for, before they are decoded.
#pragma once

#include <algorithm>

#include "scene/depth.hpp"

namespace penumbra {

// Kinds that store 0 to 1; integers of such a kind are divided by the greatest.
inline bool in_unit_range(EncodingKind kind)
{
    return kind == EncodingKind::window || kind == EncodingKind::reversed_window || kind == EncodingKind::normalized;
}

inline bool is_integer(SampleType type) { return type == SampleType::uint8 || type == SampleType::uint16 || type == SampleType::uint32; }

inline double largest_integer(SampleType type)
{
    return type == SampleType::uint8 ? 255.0 : type == SampleType::uint16 ? 65535.0 : 4294967295.0;
}

// At and above this a stored float means nothing there (docs/scene_file.md, encoding): for half-floats the largest of them.
inline float far_end(SampleType type) { return type == SampleType::float16 ? 65504.f : 1e9f; }

// A stored number as its kind reads it: from 0 to 1 where that is said. (float32 rounds the greatest of 32 bits up.)
inline double unit_value(float stored, SampleType type, EncodingKind kind)
{
    return in_unit_range(kind) && is_integer(type) ? std::min(stored / largest_integer(type), 1.0) : stored;
}

// Whether negative numbers are what stands for depth: camera-space z, which a negative scale turns round. With a shift, or in a range of 0
// to 1, the scale says nothing about what is stored.
inline bool is_flipped(const DepthEncoding& encoding)
{
    return encoding.scale < 0 && !encoding.shift && encoding.anchors.empty() && !in_unit_range(encoding.kind);
}

} // namespace penumbra
