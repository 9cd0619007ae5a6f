// What is made from the scene file's description: the schema, and texts that are checked in.
#include <filesystem>
#include <fstream>
#include <sstream>

#include <nlohmann/json.hpp>

#include "io/scene_schema.hpp"
#include "io/scene_support.hpp"
#include "io/scene_tables.hpp"
#include "technique/table.hpp"

using namespace penumbra;
using namespace penumbra::test;
using Json = nlohmann::json;

namespace {

const std::string root = std::string(PENUMBRA_EXAMPLES) + "/../";

std::string text_of(const std::string& path)
{
    std::ifstream file(root + path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

} // namespace

TEST(SceneSchema, EveryReferenceLeadsSomewhere)
{
    const Json schema = Json::parse(scene_schema_json());
    int references = 0;
    const Json flat = schema.flatten();
    for (const auto& [place, value] : flat.items()) {
        if (!place.ends_with("/$ref")) continue;
        const std::string target = value.get<std::string>();
        ASSERT_TRUE(target.starts_with("#/")) << target;
        EXPECT_TRUE(schema.contains(Json::json_pointer(target.substr(1)))) << target;
        ++references;
    }
    EXPECT_GT(references, 10);
    EXPECT_EQ(schema["$defs"]["Technique"]["anyOf"].size(), technique_table().size());
}

TEST(SceneSchema, UnknownKeysAreNone)
{
    const Json schema = Json::parse(scene_schema_json());
    for (const auto& [name, definition] : schema["$defs"].items())
        for (const Json& form : definition.contains("anyOf") ? definition["anyOf"] : Json::array({definition}))
            EXPECT_EQ(form["additionalProperties"], false) << name;
}

TEST(SceneTables, TheDocumentIsTheDescription)
{
    const std::string document = text_of("docs/scene_file.md");
    ASSERT_NE(document.find("<!-- keys of light -->"), std::string::npos);
    EXPECT_EQ(document, with_tables(document)) << "penumbra_describe_scene --docs docs/scene_file.md";
}

TEST(SceneTables, BlocksHaveNamesAndEnds)
{
    EXPECT_EQ(with_tables("no blocks\n"), "no blocks\n");
    EXPECT_MENTIONS(error_of([] { with_tables("<!-- keys of lamp -->\n<!-- end -->\n"); }), "lamp");
    EXPECT_MENTIONS(error_of([] { with_tables("<!-- keys of light -->\n"); }), "no end");
}

TEST(SceneTables, TheClientsHaveTheDescriptionsPlaces)
{
    EXPECT_EQ(text_of("clients/cpp/include/penumbra/client/file_places.hpp"), cpp_file_places()) << "penumbra_describe_scene --cpp";
    EXPECT_EQ(text_of("clients/python/penumbra_client/file_places.py"), python_file_places()) << "penumbra_describe_scene --python";
}
