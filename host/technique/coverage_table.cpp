#include "technique/coverage_table.hpp"

#include <algorithm>

namespace penumbra {

opencl::Buffer<float> coverage_table(opencl::Work& work, const opencl::Specialisation& program, const EmissionSums& sums,
                                     const EmissionPart& part, int n)
{
    const auto places = static_cast<std::size_t>(n) * static_cast<std::size_t>(n), channels = static_cast<std::size_t>(sums.channels);
    // Before rounding, for the largest row sum to be 1.
    const double most = *std::max_element(sums.sums.begin(), sums.sums.end());
    std::vector<float> rows;
    rows.reserve(sums.sums.size());
    for (const double sum : sums.sums) rows.push_back(static_cast<float>(sum / most));
    cl_float4 per_total{{0, 0, 0, 0}};
    for (std::size_t c = 0; c < channels; ++c) per_total.s[c] = part.light[c] > 0 ? static_cast<float>(most / part.light[c]) : 0.0F;

    const auto uploaded = work.upload(std::span<const float>(rows), "emission sums");
    const auto border = work.buffer<float>(places * channels, "border integrals"),
               radial = work.buffer<float>(places * channels, "radial integrals");
    auto table = work.buffer<float>(places * places * channels, "coverage table");
    work.launch(program, "border_sums", {places, 1}, {64, 1}, uploaded.bytes(), static_cast<cl_int>(n), part.window, uploaded, border,
                radial);
    work.launch(program, "coverage_table", {places, places}, {64, 1}, table.bytes(), static_cast<cl_int>(n), part.window, per_total,
                uploaded, border, radial, table, work.stop());
    return table;
}

} // namespace penumbra
