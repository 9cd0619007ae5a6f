// POST /v1/depth: the receivers' depth as the service reads it, over HTTP.
#include <cmath>
#include <span>

#include "server/client.hpp"

namespace penumbra::test {
namespace {

using Json = nlohmann::json;

// The number of a pixel, 1 to 32, in 8 x 4 pixels; nothing at the first.
DepthMap numbered()
{
    DepthMap map = flat(8, 4, 1);
    for (std::size_t i = 0; i < map.depth.size(); ++i) map.depth[i] = static_cast<float>(i + 1);
    map.depth[0] = INFINITY;
    return map;
}

Parts seen(const Json& encoding = {{"kind", "planar"}}, const std::string& name = "view.exr")
{
    const Json camera = {{"kind", "pinhole"}, {"eye", {0, 0, 0}}, {"target", {0, 0, -1}}, {"up", {0, 1, 0}}, {"vertical_fov_deg", 60}};
    const Json scene = {{"penumbra", 1},
                        {"light", {{"kind", "point"}, {"center", {0, 0, 0}}, {"direction", {0, 0, -1}}}},
                        {"receivers", {{"camera", camera}, {"depth", name}, {"encoding", encoding}}}};
    return {{"scene", scene.dump()}, {"view.exr", text_of(encode_depth(numbered()))}};
}

Reply ask_depth(const std::string& query, const Parts& all = seen())
{
    const std::string request = post(form(all));
    return ask(shared_port(), "POST /v1/depth" + query + request.substr(request.find(" HTTP/1.1")));
}

Image depth_in(const Reply& reply)
{
    EXPECT_EQ(reply.status, 200) << reply.body;
    EXPECT_EQ(reply.header("Content-Type"), "image/x-portable-floatmap");
    EXPECT_EQ(reply.header("Penumbra-Size"), "8x4");
    return decode_image(std::as_bytes(std::span(reply.body)), "depth");
}

TEST(DepthOverHttp, IsTheImageItselfWhereItIsSmall)
{
    for (const char* query : {"", "?side=8", "?side=4096"}) {
        const Image depth = depth_in(ask_depth(query));
        ASSERT_EQ(depth.width, 8);
        ASSERT_EQ(depth.height, 4);
        EXPECT_EQ(depth.pixels, numbered().depth);
    }
}

TEST(DepthOverHttp, HasPixelsOfALargerOneAndItsShape)
{
    const Image half = depth_in(ask_depth("?side=4"));
    ASSERT_EQ(half.width, 4);
    ASSERT_EQ(half.height, 2);
    EXPECT_EQ(half.pixels, (std::vector<float>{10, 12, 14, 16, 26, 28, 30, 32})); // columns 1, 3, 5, 7 of rows 1 and 3
    const Image one = depth_in(ask_depth("?side=1"));
    ASSERT_EQ(one.pixel_count(), 1u);
    EXPECT_EQ(one.pixels[0], 21); // row 2, column 4
}

TEST(DepthOverHttp, IsDecoded)
{
    const Image depth = depth_in(ask_depth("", seen({{"kind", "disparity"}, {"scale", 4}})));
    EXPECT_TRUE(std::isinf(depth.pixels[0]));
    for (std::size_t i = 1; i < depth.pixels.size(); ++i) EXPECT_EQ(depth.pixels[i], 4.0f / static_cast<float>(i + 1)) << i;
}

TEST(DepthOverHttp, RefusesWhatIsNone)
{
    for (const char* query : {"?side=0", "?side=4097", "?side=x", "?side=", "?side=1&side=2", "?light=a"}) {
        const Reply reply = ask_depth(query);
        EXPECT_EQ(reply.status, 400) << query;
        EXPECT_EQ(Json::parse(reply.body).value("reason", ""), "query") << query;
    }
    const Reply missing = ask_depth("", seen({{"kind", "planar"}}, "other.exr"));
    EXPECT_EQ(missing.status, 422) << missing.body;
    Parts none = seen();
    Json scene = Json::parse(none.front().second);
    scene["receivers"].erase("depth");
    scene["receivers"].erase("encoding");
    none.front().second = scene.dump();
    const Reply rendered = ask_depth("", none);
    EXPECT_EQ(rendered.status, 422) << rendered.body;
    EXPECT_NE(rendered.body.find("receivers.depth"), std::string::npos) << rendered.body;
}

} // namespace
} // namespace penumbra::test
