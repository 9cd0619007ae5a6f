// The scene file's description as the service gives it, and the path in its problems.
#include <penumbra/scene_file.hpp>

#include "server/client.hpp"

namespace penumbra::test {
namespace {

using Json = nlohmann::json;

TEST(SceneDescriptionOverHttp, OpenApiDescribesTheScene)
{
    const Json api = Json::parse(get(shared_port(), "/openapi.json").body);
    const Json& post = api["paths"]["/v1/masks"]["post"]["requestBody"]["content"]["multipart/form-data"]["schema"];
    EXPECT_EQ(post["properties"]["scene"]["$ref"], "#/components/schemas/Scene");
    const Json& scene = api["components"]["schemas"]["Scene"];
    const Json sent = scene_json();
    for (const auto& [key, value] : sent.items()) EXPECT_TRUE(scene["properties"].contains(key)) << key;
    const Json flat = api.flatten();
    for (const auto& [place, value] : flat.items()) {
        if (!place.ends_with("/$ref")) continue;
        const std::string target = value.get<std::string>();
        ASSERT_TRUE(target.starts_with("#/")) << target;
        EXPECT_TRUE(api.contains(Json::json_pointer(target.substr(1)))) << target;
    }
    for (const std::string_view section : patched_sections())
        EXPECT_TRUE(api["components"]["schemas"]["ScenePatch"]["properties"].contains(section)) << section;
}

TEST(SceneDescriptionOverHttp, ProblemsHaveThePath)
{
    const auto problem = [](const std::string& pointer, const Json& value) {
        Json scene = scene_json();
        scene[Json::json_pointer(pointer)] = value;
        return Json::parse(ask(shared_port(), post(form(parts(scene)))).body);
    };
    const Json wrong = problem("/light/half_u", "wide");
    EXPECT_EQ(wrong["path"], "light.half_u");
    EXPECT_TRUE(holds(wrong["detail"], "light.half_u: is the string \"wide\"")) << wrong;
    EXPECT_EQ(problem("/receivers/depth", "nowhere.exr")["path"], "receivers.depth");
    EXPECT_FALSE(Json::parse(get(shared_port(), "/secret").body).contains("path"));
}

} // namespace
} // namespace penumbra::test
