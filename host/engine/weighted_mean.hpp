// The mask of several lights together.
#pragma once

#include <vector>

#include <penumbra/image.hpp>

namespace penumbra {

// In each channel the mean by weight, summed in double in the order of adding, rounded to float32 once. One channel stands for all three
// where another image has three. Where every image is 1, so is the mean: both sums have the same terms.
class WeightedMean {
public:
    // All images are of one size.
    void add(const Image& image, double weight);
    // The mean of what was added, a weight above 0 among it.
    Image take() const;

private:
    int width_ = 0, height_ = 0, channels_ = 0;
    std::vector<double> sums_;
    double weights_ = 0;
};

} // namespace penumbra
