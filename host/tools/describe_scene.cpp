// penumbra_describe_scene: what is made from the scene file's description (io/scene_description.hpp).
//
//   --schema             JSON Schema, scene.schema.json
//   --docs SCENE_FILE.md the document with its tables written anew
//   --cpp, --python      the clients' lists of where file names stand
#include <fstream>
#include <iostream>
#include <sstream>
#include <string_view>

#include "io/scene_schema.hpp"
#include "io/scene_tables.hpp"

namespace {

std::string text_of(const char* path)
{
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

} // namespace

int main(int count, char** arguments)
{
    const std::string_view what = count > 1 ? arguments[1] : "";
    if (what == "--schema")
        std::cout << penumbra::scene_schema_json();
    else if (what == "--docs" && count > 2)
        std::cout << penumbra::with_tables(text_of(arguments[2]));
    else if (what == "--cpp")
        std::cout << penumbra::cpp_file_places();
    else if (what == "--python")
        std::cout << penumbra::python_file_places();
    else
        return std::cerr << "usage: penumbra_describe_scene --schema | --docs SCENE_FILE.md | --cpp | --python\n", 2;
    return std::cout.flush() ? 0 : 1;
}
