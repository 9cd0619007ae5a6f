#include "masks/work_limits.hpp"

#include <array>
#include <cstdio>
#include <string>
#include <string_view>

#include <penumbra/error.hpp>

namespace penumbra::server {
namespace {

std::string side_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

void check_pixels(std::string_view where, int width, int height, std::int64_t limit)
{
    if (static_cast<std::int64_t>(width) * height > limit)
        throw Error::at(ErrorCode::too_large, std::string(where), "is " + side_text(width, height),
                        "the limit of the service is " + std::to_string(limit) + " pixels");
}

void check_amount(std::string_view where, double amount, std::string_view what, std::int64_t limit)
{
    if (amount <= static_cast<double>(limit)) return;
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", amount);
    throw Error::at(ErrorCode::too_large, std::string(where), std::string("asks for ") + text.data() + " " + std::string(what),
                    "the limit of the service is " + std::to_string(limit));
}

// The option that bounds work counted in that unit.
std::int64_t limit_of(WorkAmount::Unit unit, const Options& options)
{
    switch (unit) {
    case WorkAmount::Unit::pairs:
        return options.pairs;
    case WorkAmount::Unit::rays:
        return options.rays;
    case WorkAmount::Unit::slice_texels:
        return options.image_samples;
    case WorkAmount::Unit::receivers:
        return options.receivers;
    }
    return 0;
}

} // namespace

void check_work(const MaskTask& task, const Options& options)
{
    const Receivers& receivers = *task.job.receivers;
    check_pixels("receivers.resolution", receivers.width, receivers.height, options.receivers);
    double texels = 0;
    for (const MaskLight& light : task.job.lights) {
        const Occluders& occluders = *light.occluders;
        check_pixels("occluders.resolution", occluders.width, occluders.height, options.image_samples);
        texels += static_cast<double>(occluders.width) * occluders.height;
    }
    if (task.job.lights.size() > 1) {
        const double points = static_cast<double>(receivers.width) * receivers.height * static_cast<double>(task.job.lights.size());
        check_amount("lights", points, "receivers, over all lights", options.receivers);
        check_amount("lights", texels, "texels of occluder maps, over all lights", options.image_samples);
    }
    for (const WorkAmount& work : work_of(task.job)) check_amount(work.key, work.amount, work.what, limit_of(work.unit, options));
}

} // namespace penumbra::server
