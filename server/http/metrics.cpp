#include "http/metrics.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>

#include <unistd.h>

namespace penumbra::server {
namespace {

struct Name {
    std::string_view name, type, help;
};
constexpr std::array names{
    Name{"http_requests_total", "counter", "Requests answered, by route and status."},
    Name{"http_request_duration_seconds", "histogram",
         "From connection to the answer handed over, by route; what a slow client takes after that is not in it."},
    Name{"penumbra_rejected_total", "counter", "Requests that got no mask, by reason."},
    Name{"penumbra_pixels_total", "counter", "Pixels of masks sent."},
    Name{"penumbra_upload_seconds", "histogram", "Reading the body."},
    Name{"penumbra_queue_wait_seconds", "histogram", "Waiting for a compute slot."},
    Name{"penumbra_decode_seconds", "histogram", "From JSON and images to a scene."},
    Name{"penumbra_compute_seconds", "histogram", "From a scene to a mask, by technique."},
    Name{"penumbra_encode_seconds", "histogram", "From a mask to bytes, by format."},
    Name{"penumbra_requests_admitted", "gauge", "Requests that upload, wait or compute."},
    Name{"penumbra_queue_depth", "gauge", "Requests that wait for a compute slot."},
    Name{"penumbra_requests_computing", "gauge", "Requests in a compute slot."},
    Name{"penumbra_ready", "gauge", "1 when /readyz says so."},
    Name{"penumbra_workers", "gauge", "Processes that compute, by what they do."},
    Name{"penumbra_workers_started_total", "counter", "Workers that became ready."},
    Name{"penumbra_workers_crashed_total", "counter", "Workers that died by themselves."},
    Name{"penumbra_workers_overdue_total", "counter", "Workers that did not stop at a request's deadline, and were ended."},
    Name{"penumbra_kept_scenes", "gauge", "Scenes that are kept."},
    Name{"penumbra_kept_scene_bytes", "gauge", "Memory of all kept scenes, on the device as well."},
    Name{"penumbra_kept_device_bytes", "gauge", "What kept scenes have prepared on the device."},
    Name{"penumbra_mask_device_bytes_max", "gauge", "Most device memory that a mask has taken so far."},
    Name{"penumbra_build_info", "gauge", "Version and device."},
    Name{"process_resident_memory_bytes", "gauge", "Resident memory."},
    Name{"process_start_time_seconds", "gauge", "Start of the process, Unix time."},
};

constexpr std::array<double, 14> bounds{0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10};

std::string number(double value)
{
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    return {text.data(), end};
}

std::string line(std::string_view name, const std::string& labels, double value)
{
    return std::string(name) + (labels.empty() ? "" : "{" + labels + "}") + " " + number(value) + "\n";
}

} // namespace

void Metrics::count(std::string_view name, const std::string& labels, double by)
{
    const std::scoped_lock lock(mutex_);
    counters_[std::string(name)][labels] += by;
}

void Metrics::observe(std::string_view name, const std::string& labels, double seconds)
{
    const std::scoped_lock lock(mutex_);
    Histogram& histogram = histograms_[std::string(name)][labels];
    histogram.buckets.resize(bounds.size() + 1);
    ++histogram.buckets[static_cast<std::size_t>(std::ranges::lower_bound(bounds, seconds) - bounds.begin())];
    histogram.sum += seconds;
    ++histogram.count;
}

std::string Metrics::text(const std::vector<Gauge>& gauges) const
{
    const std::scoped_lock lock(mutex_);
    std::string text;
    for (const Name& row : names) {
        std::string lines;
        if (const auto found = counters_.find(std::string(row.name)); found != counters_.end())
            for (const auto& [labels, value] : found->second) lines += line(row.name, labels, value);
        for (const Gauge& gauge : gauges)
            if (gauge.name == row.name) lines += line(row.name, gauge.labels, gauge.value);
        if (const auto found = histograms_.find(std::string(row.name)); found != histograms_.end())
            for (const auto& [labels, histogram] : found->second) {
                const std::string name(row.name), prefix = labels.empty() ? "" : labels + ",";
                std::uint64_t below = 0;
                for (std::size_t i = 0; i <= bounds.size(); ++i) {
                    below += histogram.buckets[i];
                    const std::string bound = i < bounds.size() ? number(bounds[i]) : "+Inf";
                    lines += line(name + "_bucket", prefix + "le=\"" + bound + "\"", static_cast<double>(below));
                }
                lines += line(name + "_sum", labels, histogram.sum) + line(name + "_count", labels, static_cast<double>(histogram.count));
            }
        if (!lines.empty())
            text += "# HELP " + std::string(row.name) + " " + std::string(row.help) + "\n# TYPE " + std::string(row.name) + " " +
                    std::string(row.type) + "\n" + lines;
    }
    return text;
}

double resident_bytes()
{
    std::ifstream file("/proc/self/statm");
    double total = 0, resident = 0;
    file >> total >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

} // namespace penumbra::server
