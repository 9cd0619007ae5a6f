// How far a mask is off, measured at some of its pixels.
#pragma once

#include <optional>

#include <penumbra/mask_job.hpp>

namespace penumbra {

// Of the mask of one light, which `prepared` was made for and `receivers` shaded with. Where objects cast, by shadow rays; else, for micro-patches by
// `visibility: union`, by maps of a third of the resolution. Nothing where neither can be had, and where no receiver is.
std::optional<ErrorEstimate> estimate_error(const Engine& engine, const MaskJob& job, const MaskLight& light, const Light& now, const Prepared& prepared, const Receivers& receivers,
                                            const Image& mask);

// Rays that it casts at the most, where objects cast.
double rays_of_estimate();

} // namespace penumbra
