#include "scene/orientation.hpp"

#include <array>
#include <cmath>

namespace penumbra {
namespace {

// Adds a number to a sum that is kept as numbers which do not overlap, smallest first (Shewchuk's Grow-Expansion).
struct Expansion {
    std::array<double, 12> parts{};
    int count = 0;

    void add(double number)
    {
        for (int i = 0; i < count; ++i) {
            double& part = parts[static_cast<std::size_t>(i)];
            const double sum = number + part, virtual_part = sum - number;
            part = (number - (sum - virtual_part)) + (part - virtual_part);
            number = sum;
        }
        parts[static_cast<std::size_t>(count++)] = number;
    }
    // Exactly x y.
    void add_product(double x, double y)
    {
        const double product = x * y;
        add(std::fma(x, y, -product));
        add(product);
    }
    // The largest part has the sum's sign.
    double sign() const
    {
        for (int i = count; i-- > 0;)
            if (parts[static_cast<std::size_t>(i)] != 0) return parts[static_cast<std::size_t>(i)];
        return 0;
    }
};

} // namespace

double turn(const Vec2& a, const Vec2& b, const Vec2& c)
{
    // Four differences, two products and their difference: off by at most (3 + 16 u) u of the sum of magnitudes (Shewchuk's ccwerrboundA),
    // with u = 2^-53.
    const double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x);
    const double fast = left - right;
    if (std::abs(fast) > (3 + 16 * 0x1p-53) * 0x1p-53 * (std::abs(left) + std::abs(right))) return fast;

    Expansion exact;
    exact.add_product(a.x, b.y);
    exact.add_product(-a.y, b.x);
    exact.add_product(b.x, c.y);
    exact.add_product(-b.y, c.x);
    exact.add_product(c.x, a.y);
    exact.add_product(-c.y, a.x);
    return exact.sign();
}

} // namespace penumbra
