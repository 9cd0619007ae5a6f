// The text that is compiled, made from constants and kernel files.
#include <map>

#include "fixture.hpp"
#include "opencl/kernel_files.hpp"
#include "opencl/program_text.hpp"

namespace penumbra::opencl::test {
namespace {

FileLookup files(std::map<std::string, std::string, std::less<>> texts)
{
    return [texts = std::move(texts)](std::string_view name) -> std::optional<std::string_view> {
        const auto at = texts.find(name);
        return at == texts.end() ? std::nullopt : std::optional<std::string_view>(at->second);
    };
}

TEST(ProgramText, ConstantsThenFile)
{
    EXPECT_EQ(program_text({"a.cl", {{"LANES", "16"}, {"RATE", "0.5f"}}}, files({{"a.cl", "int x;\nint y;"}})),
              "#define LANES 16\n#define RATE 0.5f\n#line 1 \"a.cl\"\nint x;\nint y;\n");
}

TEST(ProgramText, EachFileOnce)
{
    const std::string text = program_text({"a.cl", {}}, files({{"a.cl", "#include \"common/b.clh\"\n#  include \"common/s.h\"\nint a;\n"},
                                                               {"common/b.clh", "#pragma once\n#include \"s.h\"\nint b;"},
                                                               {"common/s.h", "#include <cstddef>\nint s;\n"}}));
    EXPECT_EQ(text, "#line 1 \"a.cl\"\n"
                    "#line 1 \"common/b.clh\"\n"
                    "\n"
                    "#line 1 \"common/s.h\"\n"
                    "#include <cstddef>\n"
                    "int s;\n"
                    "#line 3 \"common/b.clh\"\n"
                    "int b;\n"
                    "#line 2 \"a.cl\"\n"
                    "#line 3 \"a.cl\"\n"
                    "int a;\n");
}

TEST(ProgramText, MissingFileIsNamedWithWhoWantsIt)
{
    const Error error = error_of([] { program_text({"a.cl", {}}, files({{"a.cl", "\n#include \"b.clh\"\n"}})); });
    EXPECT_EQ(error.code(), ErrorCode::internal);
    EXPECT_TRUE(holds(error.message(), "b.clh")) << error.what();
    EXPECT_TRUE(holds(error.message(), "a.cl:2")) << error.what();
    EXPECT_EQ(error_of([] { kernel_file("no_such.cl"); }).code(), ErrorCode::internal);
}

TEST(ProgramText, EveryEmbeddedKernelExpands)
{
    ASSERT_FALSE(kernel_files().empty());
    for (const KernelFile& file : kernel_files()) {
        EXPECT_FALSE(file.text.empty()) << file.name;
        EXPECT_EQ(kernel_file(file.name), file.text);
        EXPECT_NO_THROW(program_text({std::string(file.name), {}})) << file.name;
    }
}

TEST(ProgramText, OptionsInOrder)
{
    EXPECT_EQ((Specialisation{"a.cl", {{"TILE", "8"}, {"LANES", "16"}}}.options()), "-DTILE=8 -DLANES=16");
    EXPECT_EQ((Specialisation{"a.cl", {}}.options()), "");
}

} // namespace
} // namespace penumbra::opencl::test
