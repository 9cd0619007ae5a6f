// Prometheus metrics, text format 0.0.4. Names and help stand in metrics.cpp, once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra::server {

// Labels are written as they appear: `route="/v1/masks",code="200"`. They must be of few values, never of a client's making.
class Metrics {
public:
    void count(std::string_view name, const std::string& labels, double by = 1);
    void observe(std::string_view name, const std::string& labels, double seconds); // histogram
    // A gauge of the moment.
    struct Gauge {
        std::string_view name;
        std::string labels;
        double value;
    };
    std::string text(const std::vector<Gauge>& gauges) const;

private:
    struct Histogram {
        std::vector<std::uint64_t> buckets; // not cumulative; the last one is +Inf
        double sum = 0;
        std::uint64_t count = 0;
    };
    mutable std::mutex mutex_;
    std::map<std::string, std::map<std::string, double>> counters_;
    std::map<std::string, std::map<std::string, Histogram>> histograms_;
};

double resident_bytes(); // of this process

} // namespace penumbra::server
