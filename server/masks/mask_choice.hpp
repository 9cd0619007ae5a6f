// Which of a scene's masks a request asks for, and what of it: the light, frame, image and error_estimate of its query.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra::server {

// The images that a mask comes with: Mask::visibility and Mask::bound.
enum class MaskImage { mask, bound };

struct MaskChoice {
    std::string light = {}; // a light's name; empty: all together, or the only one
    int frame = 0;          // of a sequence, from 1; 0: there is none
    MaskImage image = MaskImage::mask;
    bool error_estimate = false; // Report::error_estimate is wanted
};

// From the query's parameters. Throws Problem 400 for other parameters than these, for one that stands twice, for what is no name, no
// number, no image and neither true nor false.
MaskChoice choice_from(const std::vector<std::pair<std::string, std::string>>& query);

// What of a light decides whether it can be chosen.
struct Choosable {
    std::string name; // empty: the scene's only one, without `lights`
    int frames = 0;   // of its sequence; 0: it has none
};

// The lights that are chosen, by their places. Throws Problem 400 for a light or frame that there is not, and for a sequence without a
// frame.
std::vector<std::size_t> chosen_from(const std::vector<Choosable>& lights, const MaskChoice& choice);

} // namespace penumbra::server
