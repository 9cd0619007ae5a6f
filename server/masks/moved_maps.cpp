#include "masks/moved_maps.hpp"

#include <algorithm>
#include <optional>
#include <variant>

namespace penumbra::server {
namespace {

// Where a light stands and how its view is turned; its size is no part of that.
struct Pose {
    Vec3 center{0, 0, 0}, axis{0, 0, 0}, across{0, 0, 0};
    bool operator==(const Pose&) const = default;
};

Pose pose_of(const Light& light)
{
    const auto pose = [](const auto& l) {
        Pose p;
        if constexpr (requires { l.center; }) p.center = l.center;
        if constexpr (requires { l.half_u; }) {
            p.axis = l.half_v.normalized();
            p.across = l.half_u.normalized();
        } else {
            p.axis = l.direction.normalized();
            p.across = l.up.value_or(Vec3(0, 0, 0));
        }
        return p;
    };
    return std::visit(pose, light);
}

bool was_sent(const Occluders& occluders)
{
    return std::holds_alternative<LightCamera>(occluders.camera) && (occluders.front || occluders.back || !occluders.layers.empty());
}

bool same_depth(const std::optional<DepthMap>& a, const std::optional<DepthMap>& b)
{
    return a.has_value() == b.has_value() && (!a || a->depth == b->depth);
}

bool same_maps(const Occluders& a, const Occluders& b)
{
    return &a == &b || (same_depth(a.front, b.front) && same_depth(a.back, b.back) && a.layers.size() == b.layers.size());
}

bool sent_from_light(const Receivers& receivers) { return std::holds_alternative<LightCamera>(receivers.camera) && receivers.depth; }

} // namespace

std::vector<std::string> warnings_of_moved_maps(const MaskJob& before, const MaskJob& after)
{
    std::vector<std::string> warnings;
    for (const MaskLight& now : after.lights) {
        const auto was = std::ranges::find(before.lights, now.name, &MaskLight::name);
        if (was == before.lights.end() || pose_of(was->light) == pose_of(now.light)) continue;
        const bool casters = was_sent(*now.occluders) && same_maps(*was->occluders, *now.occluders);
        const bool receivers = sent_from_light(*after.receivers) && sent_from_light(*before.receivers) && same_depth(before.receivers->depth, after.receivers->depth);
        if (!casters && !receivers) continue;
        const std::string which = casters && receivers ? "occluders.depth and receivers.depth were sent as" : casters ? "occluders.depth was sent as" : "receivers.depth was sent as";
        warnings.push_back((now.name.empty() ? std::string() : now.name + ": ") + which +
                           " the light's own view and moved with the light, and what it shows moved as well: to move the light alone, send objects (meshes, "
                           "quads, depth objects) or a receivers' camera of kind pinhole, or maps that are seen from the new place");
    }
    return warnings;
}

} // namespace penumbra::server
