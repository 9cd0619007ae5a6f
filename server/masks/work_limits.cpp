#include "masks/work_limits.hpp"

#include <algorithm>
#include <array>
#include <chrono>
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

// So few are some seconds of one core at the most, and not worth a sample.
constexpr std::int64_t few_pairs = std::int64_t{1} << 33, few_rays = std::int64_t{1} << 26;

// A sample tells the time within a factor of some two: what is over the time left by this much does not end within it.
constexpr double surely = 4;

void check_time(const WorkAmount& work, const Deadline& deadline)
{
    const double left = std::chrono::duration<double>(deadline.end() - Deadline::Clock::now()).count();
    if (work.seconds <= surely * std::max(left, 0.0)) return;
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), "would take about %.0f s, as a sample of the mask did", work.seconds);
    std::array<char, 96> hint{};
    std::snprintf(hint.data(), hint.size(), "expected at most the %.0f s that are left of the request's time", std::max(left, 0.0));
    throw Error::at(ErrorCode::too_large, std::string(work.key), text.data(), hint.data());
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
    // Of pairs the sizes tell far too many (estimate_check).
    for (const WorkAmount& work : work_of(task.job))
        if (work.unit != WorkAmount::Unit::pairs) check_amount(work.key, work.amount, work.what, limit_of(work.unit, options));
}

std::function<void(const WorkAmount&)> estimate_check(const MaskTask& task, const Options& options, const Deadline& deadline)
{
    const double least = static_cast<double>(std::min(options.pairs, few_pairs));
    const std::vector<WorkAmount> most = work_of(task.job);
    const auto may_take_long = [&](const WorkAmount& work) {
        return (work.unit == WorkAmount::Unit::pairs && work.amount > least) ||
               (work.unit == WorkAmount::Unit::rays && work.amount > static_cast<double>(few_rays));
    };
    if (std::ranges::none_of(most, may_take_long)) return {};
    return [&options, &deadline, pairs = 0.0](const WorkAmount& work) mutable {
        if (work.unit == WorkAmount::Unit::pairs) {
            pairs += work.amount;
            check_amount(work.key, pairs, work.what, options.pairs);
        }
        check_time(work, deadline);
    };
}

} // namespace penumbra::server
