#include "trace/cut_filter.hpp"

#include <string>

#include <penumbra/error.hpp>

#include "scene/cut_out.hpp"

namespace penumbra {

void require_cut_outs(const TriangleMesh& mesh, std::size_t mesh_index)
{
    if (!mesh.cut_outs) return;
    const CutOuts& cuts = *mesh.cut_outs;
    const auto fail = [&](const std::string& what) {
        throw Error(ErrorCode::invalid_input, "objects[" + std::to_string(mesh_index) + "]: cut_outs " + what);
    };
    if (cuts.image.size() != mesh.triangles.size() || cuts.texture.size() != mesh.triangles.size())
        fail("are for " + std::to_string(cuts.image.size()) + " triangles, the mesh has " + std::to_string(mesh.triangles.size()));
    for (const std::uint32_t image : cuts.image)
        if (image != CutOuts::none && image >= cuts.images.size())
            fail("name image " + std::to_string(image) + " of " + std::to_string(cuts.images.size()));
    for (const CutOut& cut : cuts.images)
        if (cut.alpha.width < 1 || cut.alpha.height < 1 || cut.alpha.channels != 1 || cut.alpha.pixels.size() != cut.alpha.pixel_count())
            fail("have an image that is not of one channel, 1 x 1 or larger");
}

TracedCut cut_of(const TriangleMesh& mesh, std::size_t triangle)
{
    if (!mesh.cut_outs || mesh.cut_outs->image[triangle] == CutOuts::none) return {};
    return {&mesh.cut_outs->images[mesh.cut_outs->image[triangle]], mesh.cut_outs->texture[triangle]};
}

bool is_there(const TracedCut& cut, float u, float v)
{
    if (!cut.image) return true;
    return is_there(*cut.image, cut.texture[0] * (1 - u - v) + cut.texture[1] * u + cut.texture[2] * v);
}

void pass_cut_outs(const RTCFilterFunctionNArguments* arguments)
{
    const auto& cuts = *static_cast<const std::vector<TracedCut>*>(arguments->geometryUserPtr);
    const unsigned count = arguments->N;
    for (unsigned i = 0; i < count; ++i) {
        if (arguments->valid[i] == 0) continue;
        const TracedCut& cut = cuts[RTCHitN_primID(arguments->hit, count, i)];
        if (!is_there(cut, RTCHitN_u(arguments->hit, count, i), RTCHitN_v(arguments->hit, count, i))) arguments->valid[i] = 0;
    }
}

} // namespace penumbra
