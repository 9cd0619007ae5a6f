// Error metrics between two masks.
//
// A pixel is a shadow pixel when any of its channels is below 0.999 in either image; all of its channels then count. Means and percentiles
// are over samples (pixels times channels); the off_ shares are over pixels, which are off when any of their channels is.
#include <penumbra/metrics.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

template <class... Parts> std::string text(const Parts&... parts)
{
    std::ostringstream out;
    (out << ... << parts);
    return out.str();
}

// Two float32 values in [0, 1] that stand for numbers a given step apart are each rounded by at most 2^-25 (half a unit in the last place
// below 1). Their difference may therefore exceed the step by 2^-24 without the step being larger.
constexpr double rounding_slack = 0x1p-24;

// Neumaier's compensated sum: its error does not grow with the number of terms.
class Sum {
public:
    void add(double term)
    {
        const double next = sum_ + term;
        rest_ += std::abs(sum_) >= std::abs(term) ? (sum_ - next) + term : (term - next) + sum_;
        sum_ = next;
    }
    double value() const { return sum_ + rest_; }

private:
    double sum_ = 0, rest_ = 0;
};

struct Accumulated {
    Sum difference, absolute, square;
    std::vector<double> magnitudes; // for the percentile

    void add(double d)
    {
        difference.add(d);
        absolute.add(std::abs(d));
        square.add(d * d);
        magnitudes.push_back(std::abs(d));
    }
    double mean(const Sum& sum) const { return magnitudes.empty() ? 0.0 : sum.value() / static_cast<double>(magnitudes.size()); }
};

// The value at position 0.99 (n - 1) of the sorted values, counted from 0, linearly interpolated between the two that it falls between
// (Hyndman and Fan's definition 7, numpy's default). 0 without values. Reorders them.
double percentile_99(std::vector<double>& values)
{
    if (values.empty()) return 0;
    const double position = 0.99 * static_cast<double>(values.size() - 1);
    const auto below = values.begin() + static_cast<std::ptrdiff_t>(std::floor(position));
    std::nth_element(values.begin(), below, values.end());
    const double low = *below;
    if (below + 1 == values.end()) return low;
    const double high = *std::min_element(below + 1, values.end());
    return low + (position - std::floor(position)) * (high - low);
}

void require_finite(const Image& image, const char* which)
{
    const auto bad = std::find_if(image.pixels.begin(), image.pixels.end(), [](float value) { return !std::isfinite(value); });
    if (bad == image.pixels.end()) return;
    const auto sample = static_cast<std::size_t>(bad - image.pixels.begin());
    const auto channels = static_cast<std::size_t>(image.channels), width = static_cast<std::size_t>(image.width);
    const std::size_t pixel = sample / channels;
    throw Error(ErrorCode::invalid_input,
                text(which, ": pixel (", pixel % width, ", ", pixel / width, "), channel ", sample % channels, ", is ", *bad),
                "visibility is finite, 0 to 1");
}

void require_pixels(const Image& image, const char* which)
{
    if (image.width > 0 && image.height > 0 && image.channels > 0 &&
        image.pixels.size() == image.pixel_count() * static_cast<std::size_t>(image.channels))
        return;
    throw Error(ErrorCode::invalid_input, text(which, ": ", image.width, " x ", image.height, " pixels of ", image.channels,
                                               " channels with ", image.pixels.size(), " samples"));
}

void require_comparable(const Image& test, const Image& reference)
{
    require_pixels(test, "test");
    require_pixels(reference, "reference");
    if (test.width != reference.width || test.height != reference.height)
        throw Error(ErrorCode::invalid_input,
                    text("test is ", test.width, " x ", test.height, " and reference is ", reference.width, " x ", reference.height),
                    "both need the same resolution");
    if (test.channels != reference.channels)
        throw Error(ErrorCode::invalid_input, text("test has ", test.channels, " and reference has ", reference.channels, " channels"),
                    "both need the same channels");
    require_finite(test, "test");
    require_finite(reference, "reference");
}

} // namespace

Metrics compare(const Image& test, const Image& reference)
{
    require_comparable(test, reference);

    Accumulated all, shadow;
    all.magnitudes.reserve(test.pixels.size());
    Metrics metrics;
    metrics.pixels = test.pixel_count();
    std::uint64_t off_1_255 = 0, off_0_05 = 0;

    const auto channels = static_cast<std::size_t>(test.channels);
    for (std::size_t first = 0; first < test.pixels.size(); first += channels) {
        bool in_shadow = false;
        double largest = 0;
        for (std::size_t i = first; i < first + channels; ++i) {
            const double difference = static_cast<double>(test.pixels[i]) - static_cast<double>(reference.pixels[i]);
            all.add(difference);
            largest = std::max(largest, std::abs(difference));
            in_shadow = in_shadow || test.pixels[i] < shadow_below || reference.pixels[i] < shadow_below;
        }
        metrics.max = std::max(metrics.max, largest);
        if (!in_shadow) continue;

        ++metrics.pixels_shadow;
        off_1_255 += largest > 1.0 / 255 + rounding_slack ? 1 : 0;
        off_0_05 += largest > 0.05 + rounding_slack ? 1 : 0;
        for (std::size_t i = first; i < first + channels; ++i)
            shadow.add(static_cast<double>(test.pixels[i]) - static_cast<double>(reference.pixels[i]));
    }

    metrics.mae = all.mean(all.absolute);
    metrics.rmse = std::sqrt(all.mean(all.square));
    metrics.p99 = percentile_99(all.magnitudes);
    metrics.mae_shadow = shadow.mean(shadow.absolute);
    metrics.rmse_shadow = std::sqrt(shadow.mean(shadow.square));
    metrics.bias_shadow = shadow.mean(shadow.difference);
    metrics.p99_shadow = percentile_99(shadow.magnitudes);
    if (metrics.pixels_shadow > 0) {
        metrics.off_1_255_shadow = static_cast<double>(off_1_255) / static_cast<double>(metrics.pixels_shadow);
        metrics.off_0_05_shadow = static_cast<double>(off_0_05) / static_cast<double>(metrics.pixels_shadow);
    }
    return metrics;
}

// With t = (test - reference) / full_scale, clamped to [-1, 1], of the channel that differs most: (1 - t, 1 - t, 1) for t below 0 taken as
// positive, (1, 1 - t, 1 - t) above. White to pure blue and to pure red, so t can be read back from the picture.
Image difference_image(const Image& test, const Image& reference, double full_scale)
{
    if (!(full_scale > 0) || !std::isfinite(full_scale))
        throw Error(ErrorCode::usage, text("full scale: ", full_scale, " is not a positive number"));
    require_comparable(test, reference);

    Image picture{test.width, test.height, 3, std::vector<float>(test.pixel_count() * 3)};
    const auto channels = static_cast<std::size_t>(test.channels);
    for (std::size_t pixel = 0; pixel < test.pixel_count(); ++pixel) {
        double largest = 0;
        for (std::size_t i = pixel * channels; i < (pixel + 1) * channels; ++i) {
            const double difference = static_cast<double>(test.pixels[i]) - static_cast<double>(reference.pixels[i]);
            if (std::abs(difference) > std::abs(largest)) largest = difference;
        }
        const double t = std::clamp(largest / full_scale, -1.0, 1.0);
        const auto fade = static_cast<float>(1 - std::abs(t));
        picture.pixels[pixel * 3] = t < 0 ? fade : 1.0f;
        picture.pixels[pixel * 3 + 1] = fade;
        picture.pixels[pixel * 3 + 2] = t > 0 ? fade : 1.0f;
    }
    return picture;
}

} // namespace penumbra
