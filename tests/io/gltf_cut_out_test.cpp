// What glTF's materials cut out.
#include "io/gltf_support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

std::string picture(const std::vector<float>& alpha)
{
    Image image{.width = static_cast<int>(alpha.size()), .height = 1, .channels = 4, .pixels = {}};
    for (const float value : alpha) image.pixels.insert(image.pixels.end(), {0.5f, 0.5f, 0.5f, value});
    const std::vector<std::byte> bytes = encode_image(image, {"png", 8});
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Gltf leaf(const json& material)
{
    Gltf gltf;
    const int positions = gltf.accessor(corner_triangle, "VEC3");
    const int texture = gltf.accessor(std::vector<std::uint8_t>{0, 0, 255, 0, 0, 255}, "VEC2", true);
    gltf.node({{"mesh", gltf.mesh({{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", texture}}}, {"material", 0}})}});
    gltf.push("materials", material);
    gltf.push("textures", {{"source", 0}, {"sampler", 0}});
    gltf.push("samplers", {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}});
    gltf.push("images", {{"uri", "a%20leaf.png"}});
    return gltf;
}

const json mask = {{"alphaMode", "MASK"},
                   {"alphaCutoff", 0.25},
                   {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"baseColorFactor", {1, 1, 1, 0.5}}}}};

} // namespace

TEST(GltfCutOut, MasksCut)
{
    const std::map<std::string, std::string> files{{"a leaf.png", picture({0, 1})}};
    const PolygonSoup soup = leaf(mask).read(files);
    ASSERT_EQ(soup.cuts.size(), 1u);
    EXPECT_EQ(soup.cut, (std::vector<std::uint32_t>{0}));
    EXPECT_EQ(soup.cuts[0].alpha.pixels, (std::vector<float>{0, 1}));
    EXPECT_EQ(soup.cuts[0].cutoff, 0.5f) << "the factor is in the cutoff";
    EXPECT_EQ(soup.cuts[0].beyond_u, CutOut::Beyond::clamp);
    EXPECT_EQ(soup.cuts[0].beyond_v, CutOut::Beyond::mirror);
    EXPECT_TRUE(soup.cuts[0].nearest);
    EXPECT_EQ(soup.texture, (std::vector<Imath::V2f>{{0, 0}, {1, 0}, {0, 1}}));

    // The image in the buffer instead.
    Gltf inside = leaf(mask);
    const std::string png = files.at("a leaf.png");
    inside.root["images"][0] = {{"bufferView", inside.view(std::vector<std::uint8_t>(png.begin(), png.end()))}, {"mimeType", "image/png"}};
    EXPECT_EQ(inside.read().cuts.size(), 1u);
}

TEST(GltfCutOut, OpaqueMaterialsNeedNoImage)
{
    json opaque = mask;
    opaque["alphaMode"] = "OPAQUE";
    EXPECT_TRUE(leaf(opaque).read().cuts.empty());
    EXPECT_EQ(error_of([] { leaf(mask).read(); }).code(), ErrorCode::not_found);
    EXPECT_TRUE(leaf(mask).read({{"a leaf.png", picture({0.6f, 1})}}).cuts.empty()) << "nothing is below the cutoff";

    std::vector<std::string> warnings;
    opaque["alphaMode"] = "BLEND";
    EXPECT_EQ(leaf(opaque).read({}, &warnings).sizes.size(), 1u);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("BLEND"), std::string::npos);
}

TEST(GltfCutOut, AFactorAloneHidesAll)
{
    json factor = mask;
    factor["pbrMetallicRoughness"].erase("baseColorTexture");
    EXPECT_EQ(leaf(factor).read().sizes.size(), 1u);
    factor["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.125};
    EXPECT_TRUE(leaf(factor).read().sizes.empty());
}

TEST(GltfCutOut, TextureTransforms)
{
    json turned = mask;
    turned["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] = {
        {"offset", {1, 2}}, {"rotation", std::acos(-1.0) / 2}, {"scale", {4, 8}}};
    const PolygonSoup soup = leaf(turned).read({{"a leaf.png", picture({0, 1})}});
    // The extension's matrix: u' = u sx cos + v sy sin + ox, v' = -u sx sin + v sy cos + oy.
    const std::vector<Imath::V2f> expected{{1, 2}, {1, -2}, {9, 2}};
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT((soup.texture[i] - expected[i]).length(), 1e-6f) << i;
    turned["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 1;
    EXPECT_EQ(error_of([&] { leaf(turned).read({{"a leaf.png", picture({0, 1})}}); }).code(), ErrorCode::invalid_input);
}
