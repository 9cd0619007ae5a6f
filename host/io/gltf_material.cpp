#include "io/gltf_material.hpp"

#include <cmath>

#include "io/cut_image.hpp"
#include "io/gltf_accessor.hpp"

namespace penumbra {

namespace {

// KHR_texture_transform, and which texture coordinates it wants.
struct TextureView {
    int set = 0;
    Imath::V2d offset{0, 0}, scale{1, 1};
    double rotation = 0;

    Imath::V2f operator()(double u, double v) const
    {
        const double c = std::cos(rotation), s = std::sin(rotation), x = u * scale.x, y = v * scale.y;
        return Imath::V2f(Imath::V2d(c * x + s * y, c * y - s * x) + offset);
    }
};

void read_pair(const tinygltf::Value& value, const char* key, Imath::V2d& pair)
{
    if (!value.Has(key) || !value.Get(key).IsArray() || value.Get(key).ArrayLen() != 2) return;
    for (int i = 0; i < 2; ++i) pair[i] = value.Get(key).Get(i).GetNumberAsDouble();
}

TextureView view_of(const tinygltf::TextureInfo& info)
{
    TextureView view{.set = info.texCoord};
    const auto found = info.extensions.find("KHR_texture_transform");
    if (found == info.extensions.end() || !found->second.IsObject()) return view;
    const tinygltf::Value& transform = found->second;
    read_pair(transform, "offset", view.offset);
    read_pair(transform, "scale", view.scale);
    if (transform.Has("rotation")) view.rotation = transform.Get("rotation").GetNumberAsDouble();
    if (transform.Has("texCoord")) view.set = transform.Get("texCoord").GetNumberAsInt();
    return view;
}

CutOut::Beyond beyond_of(int wrap)
{
    if (wrap == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return CutOut::Beyond::clamp;
    return wrap == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? CutOut::Beyond::mirror : CutOut::Beyond::repeat;
}

double alpha_factor(const tinygltf::Material& material)
{
    const std::vector<double>& factor = material.pbrMetallicRoughness.baseColorFactor;
    return factor.size() == 4 ? factor[3] : 1;
}

} // namespace

// The cut-out of a material; not_cut for one without an image or whose image leaves everything.
std::uint32_t GltfMaterials::cut_of(int index)
{
    const auto [known, is_new] = known_.emplace(index, not_cut);
    if (!is_new) return known->second;
    const tinygltf::Material& material = file_.model.materials[static_cast<std::size_t>(index)];
    const tinygltf::Texture& texture = file_.entry(file_.model.textures, material.pbrMetallicRoughness.baseColorTexture.index, "textures");
    if (texture.source < 0)
        throw Error(ErrorCode::unsupported, std::string(file_.source.where) + " has a cut-out whose texture has no image that is read",
                    "PNG or JPEG");

    const std::string name = std::string(file_.source.where) + ": images[" + std::to_string(texture.source) + "]";
    auto alpha = cut_image(image_bytes(file_, texture.source), name, AlphaOf::alpha, file_.source.max_samples);
    if (!alpha) return not_cut;
    // alpha * factor >= cutoff
    CutOut cut{.alpha = std::move(*alpha), .cutoff = static_cast<float>(material.alphaCutoff / alpha_factor(material))};
    if (texture.sampler >= 0) {
        const tinygltf::Sampler& sampler = file_.entry(file_.model.samplers, texture.sampler, "samplers");
        cut.beyond_u = beyond_of(sampler.wrapS);
        cut.beyond_v = beyond_of(sampler.wrapT);
        cut.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    if (cuts_nothing(cut)) return not_cut;
    soup_.cuts.push_back(std::move(cut));
    return known->second = static_cast<std::uint32_t>(soup_.cuts.size() - 1);
}

bool GltfMaterials::cut(const tinygltf::Primitive& primitive, GltfPrimitive& part)
{
    if (primitive.material < 0) return true;
    const tinygltf::Material& material = file_.entry(file_.model.materials, primitive.material, "materials");
    blended_ += material.alphaMode == "BLEND";
    if (material.alphaMode != "MASK" || !(material.alphaCutoff > 0)) return true;
    if (!(alpha_factor(material) > 0)) return false;
    const tinygltf::TextureInfo& info = material.pbrMetallicRoughness.baseColorTexture;
    if (info.index < 0) return alpha_factor(material) >= material.alphaCutoff;

    const TextureView view = view_of(info);
    const auto coordinates = primitive.attributes.find("TEXCOORD_" + std::to_string(view.set));
    if (coordinates == primitive.attributes.end()) throw file_.broken("has a cut-out without TEXCOORD_" + std::to_string(view.set));
    part.cut = cut_of(primitive.material);
    if (part.cut == not_cut) return alpha_factor(material) >= material.alphaCutoff;
    const std::vector<double> numbers = read_numbers(file_, coordinates->second, 2);
    if (numbers.size() != 2 * part.positions.size())
        throw file_.broken("has texture coordinates for " + std::to_string(numbers.size() / 2) + " of " +
                           std::to_string(part.positions.size()) + " vertices");
    for (std::size_t i = 0; i < numbers.size(); i += 2) part.texture.push_back(view(numbers[i], numbers[i + 1]));
    return true;
}

} // namespace penumbra
