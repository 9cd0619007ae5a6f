#include "engine/weighted_mean.hpp"

#include <algorithm>

namespace penumbra {
namespace {

// One channel's sums, for each of three.
std::vector<double> spread(const std::vector<double>& grey)
{
    std::vector<double> sums;
    sums.reserve(grey.size() * 3);
    for (const double sum : grey) sums.insert(sums.end(), 3, sum);
    return sums;
}

} // namespace

void WeightedMean::add(const Image& image, double weight)
{
    if (channels_ == 0) {
        width_ = image.width;
        height_ = image.height;
        channels_ = image.channels;
        sums_.assign(image.pixels.size(), 0);
    } else if (channels_ == 1 && image.channels == 3) {
        sums_ = spread(sums_);
        channels_ = 3;
    }
    const std::size_t copies = static_cast<std::size_t>(channels_ / image.channels);
    for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += weight * image.pixels[i / copies];
    weights_ += weight;
}

Image WeightedMean::take() const
{
    Image mean{.width = width_, .height = height_, .channels = channels_, .pixels = std::vector<float>(sums_.size())};
    std::ranges::transform(sums_, mean.pixels.begin(), [&](double sum) { return static_cast<float>(sum / weights_); });
    return mean;
}

} // namespace penumbra
