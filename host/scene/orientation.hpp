// On which side of a line a point lies, without rounding.
#pragma once

#include <penumbra/scene.hpp>

namespace penumbra {

// Above 0 when a, b, c turn counter-clockwise, below 0 when clockwise, 0 when they lie in one line: the sign is exact for finite points
// whose products neither overflow nor underflow (Shewchuk: Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
// Predicates, 1997).
double turn(const Vec2& a, const Vec2& b, const Vec2& c);

} // namespace penumbra
