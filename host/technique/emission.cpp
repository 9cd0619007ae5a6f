#include "technique/emission.hpp"

#include <algorithm>
#include <cmath>

namespace penumbra {

const Image* emission_of(const Light& light)
{
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    return rectangle && rectangle->emission ? &*rectangle->emission : nullptr;
}

namespace {

// The mean of the texels that [from, to) of an axis of `count` covers falls on, as weights: first texel, and a weight for each from there
// on.
struct Covered {
    int first;
    std::vector<double> weights;
};

Covered covered(int index, int from_count, int to_count)
{
    const double low = static_cast<double>(index) * from_count / to_count, high = static_cast<double>(index + 1) * from_count / to_count;
    Covered result{static_cast<int>(low), {}};
    for (int texel = result.first; texel < from_count && texel < high; ++texel)
        result.weights.push_back((std::min(high, texel + 1.0) - std::max(low, static_cast<double>(texel))) / (high - low));
    return result;
}

// The integral of one channel's emission over a row from the left to `x`.
double row_sum(const EmissionSums& sums, int row, double x, int channel)
{
    const int column = std::clamp(static_cast<int>(x), 0, sums.width - 1);
    const auto at = [&](int c) {
        return sums.sums[(static_cast<std::size_t>(row) * static_cast<std::size_t>(sums.width + 1) + static_cast<std::size_t>(c)) *
                             static_cast<std::size_t>(sums.channels) +
                         static_cast<std::size_t>(channel)];
    };
    return std::lerp(at(column), at(column + 1), x - column);
}

} // namespace

EmissionSums emission_sums(const Image* emission, int most)
{
    const Image even{.width = 1, .height = 1, .channels = 1, .pixels = {1.0F}};
    const Image& image = emission ? *emission : even;
    EmissionSums result{
        .width = std::min(image.width, most), .height = std::min(image.height, most), .channels = image.channels, .sums = {}};
    std::vector<double> texels(static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.height) *
                               static_cast<std::size_t>(image.channels));
    std::vector<double> totals(static_cast<std::size_t>(image.channels), 0.0);
    std::size_t at = 0;
    for (int y = 0; y < result.height; ++y) {
        const Covered rows = covered(y, image.height, result.height);
        for (int x = 0; x < result.width; ++x) {
            const Covered columns = covered(x, image.width, result.width);
            for (int c = 0; c < image.channels; ++c, ++at) {
                for (std::size_t j = 0; j < rows.weights.size(); ++j)
                    for (std::size_t i = 0; i < columns.weights.size(); ++i)
                        texels[at] += rows.weights[j] * columns.weights[i] *
                                      image.at(columns.first + static_cast<int>(i), rows.first + static_cast<int>(j), c);
                totals[static_cast<std::size_t>(c)] += texels[at];
            }
        }
    }
    result.sums.reserve(texels.size() + static_cast<std::size_t>(result.height * image.channels));
    for (int y = 0; y < result.height; ++y) {
        std::vector<double> sum(static_cast<std::size_t>(image.channels), 0.0);
        result.sums.insert(result.sums.end(), sum.begin(), sum.end());
        for (int x = 0; x < result.width; ++x)
            for (int c = 0; c < image.channels; ++c) {
                const auto channel = static_cast<std::size_t>(c);
                const std::size_t texel =
                    (static_cast<std::size_t>(y) * static_cast<std::size_t>(result.width) + static_cast<std::size_t>(x)) *
                        static_cast<std::size_t>(image.channels) +
                    channel;
                sum[channel] += totals[channel] > 0 ? texels[texel] : 1.0;
                result.sums.push_back(sum[channel]);
            }
    }
    return result;
}

EmissionPart emission_part(const EmissionSums& sums, double x, double y, double half)
{
    const double left = (x - half + 1) / 2 * sums.width, right = (x + half + 1) / 2 * sums.width;
    const double top = (1 - y - half) / 2 * sums.height, bottom = (1 - y + half) / 2 * sums.height;
    EmissionPart result{.window = {.width = sums.width,
                                   .height = sums.height,
                                   .left = static_cast<float>(left),
                                   .top = static_cast<float>(top),
                                   .right = static_cast<float>(right),
                                   .bottom = static_cast<float>(bottom)},
                        .light = {}};
    for (int row = std::max(0, static_cast<int>(top)); row < sums.height && row < bottom; ++row) {
        const double height = std::min(bottom, row + 1.0) - std::max(top, static_cast<double>(row));
        for (int c = 0; c < sums.channels; ++c)
            result.light[static_cast<std::size_t>(c)] += height * (row_sum(sums, row, right, c) - row_sum(sums, row, left, c));
    }
    return result;
}

} // namespace penumbra
