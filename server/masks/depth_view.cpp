#include "masks/depth_view.hpp"

#include <algorithm>
#include <charconv>

#include <penumbra/error.hpp>

#include "process/problem.hpp"

namespace penumbra::server {

int depth_side_from(const std::vector<std::pair<std::string, std::string>>& query)
{
    if (query.empty()) return default_depth_side;
    const auto& [key, text] = query.front();
    if (key != "side" || query.size() > 1) throw Problem(400, "query", "the query has an unknown parameter, or one twice; known: side");
    int side = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), side);
    if (error != std::errc{} || end != text.data() + text.size() || side < 1 || side > max_depth_side)
        throw Problem(400, "query", "side: is no number of pixels; expected 1 to " + std::to_string(max_depth_side) + " in the query");
    return side;
}

Image depth_view(const Receivers& receivers, int side)
{
    if (!receivers.depth) throw Error::at(ErrorCode::invalid_input, "receivers.depth", "is missing", "name the image whose depth you want");
    const DepthMap& map = *receivers.depth;
    const int longest = std::max(map.width, map.height);
    // Both sides shrink alike, so that the image keeps its shape.
    const auto shrunk = [&](int length) {
        return longest <= side ? length : std::max(1, static_cast<int>(std::int64_t{length} * side / longest));
    };
    Image view{shrunk(map.width), shrunk(map.height), 1, {}};
    view.pixels.reserve(view.pixel_count());
    // The pixel under the middle of each.
    const auto place = [](int i, int of, int among) {
        return static_cast<std::size_t>((2 * std::int64_t{i} + 1) * among / (2 * std::int64_t{of}));
    };
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x)
            view.pixels.push_back(
                map.depth[place(y, view.height, map.height) * static_cast<std::size_t>(map.width) + place(x, view.width, map.width)]);
    return view;
}

} // namespace penumbra::server
