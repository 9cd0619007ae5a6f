#include "technique/occlusion_levels.hpp"

#include <algorithm>
#include <cmath>

namespace penumbra {
namespace {

constexpr std::uint64_t block = 1024; // LEVEL_BLOCK of occlusion_levels.cl

// Texels of nothing that a level has on each side: of an N-buffer, those whose mean still meets the window, and one; of a smooth level as
// far as its taps reach.
int padding(int level, LevelKind kind)
{
    if (level == 0 || kind == LevelKind::mipmap) return 1;
    if (kind == LevelKind::smooth) return 2 * ((1 << level) - 1) + 1;
    return (1 << (level - 1)) + 1;
}

OcclusionLevel level_of(int level, int side, LevelKind kind)
{
    const int apart = kind == LevelKind::mipmap ? 1 << level : 1;
    const int texels = (side + apart - 1) / apart, stored = texels + 2 * padding(level, kind);
    // An N-buffer's texel stands for as much before it as after it, counted from its lower border, but at level 0.
    const bool between = kind == LevelKind::nbuffer && level > 0;
    return {.width = stored,
            .height = stored,
            .stride = (stored + 15) / 16 * 16,
            .rows = stored,
            .scale = 1.0F / static_cast<float>(apart),
            .shift = static_cast<float>(padding(level, kind)) - (between ? 0.0F : 0.5F),
            .offset = 0};
}

} // namespace

LevelKind level_kind(bool directional, const OcclusionTexture& settings)
{
    if (settings.prefilter == Prefilter::summed_area) return LevelKind::table;
    if (settings.prefilter == Prefilter::mipmap) return LevelKind::mipmap;
    return directional ? LevelKind::smooth : LevelKind::nbuffer;
}

std::size_t element_size(LevelKind kind, const OcclusionTexture& settings)
{
    return kind != LevelKind::table && settings.storage == LevelStorage::normalized16 ? 2 : 4;
}

bool is_layered(const OcclusionTexture& settings)
{
    return settings.combine == Combine::layered || settings.combine == Combine::layered_max;
}

int levels_for(double size, int side, LevelKind kind)
{
    if (kind == LevelKind::table) return 1;
    const auto highest = [](double texels) { return static_cast<int>(std::ceil(std::log2(std::max(texels, 1.0)))); };
    // The variance of a smooth level l, (4^l - 1) / 3, is that of a disc 2.3 times 2^l across.
    return std::min(highest(size), highest(side)) + 1;
}

LevelLayout level_layout(const std::vector<int>& levels, int side, LevelKind kind)
{
    LevelLayout layout;
    const int most = levels.empty() ? 0 : levels.front();
    for (int level = 0; level < most; ++level) {
        OcclusionLevel one = level_of(level, side, kind);
        const auto textures = std::count_if(levels.begin(), levels.end(), [&](int count) { return count > level; });
        one.offset = static_cast<int>(layout.elements / block);
        const std::uint64_t elements =
            static_cast<std::uint64_t>(textures) * static_cast<std::uint64_t>(one.rows) * static_cast<std::uint64_t>(one.stride);
        layout.elements += (elements + block - 1) / block * block;
        layout.levels.push_back(one);
        layout.textures.push_back(static_cast<int>(textures));
    }
    return layout;
}

} // namespace penumbra
