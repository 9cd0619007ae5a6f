// The table of techniques: every key is documented, checked and round-trips.
#include <set>

#include "support/device_run.hpp"
#include "support/maps.hpp"

#include "opencl/context.hpp"
#include "opencl/kernel_files.hpp"
#include "opencl/program_cache.hpp"
#include "technique/techniques.hpp"

namespace penumbra::test {
namespace {

// Values inside and outside a domain.
struct Examples {
    std::vector<SettingValue> good, bad;
};

struct ExamplesOf {
    Examples operator()(const Flag&) const { return {{true, false}, {std::int64_t{1}, 1.0, std::string("true")}}; }
    Examples operator()(const IntegerRange& r) const
    {
        Examples e{{r.low, r.high}, {static_cast<double>(r.low), std::string("1"), true}};
        if (r.low > INT64_MIN) e.bad.emplace_back(r.low - 1);
        if (r.high < INT64_MAX) e.bad.emplace_back(r.high + 1);
        return e;
    }
    Examples operator()(const RealRange& r) const
    {
        return {{r.low, r.high, (r.low + r.high) / 2},
                {r.low - 1e-3, r.high + 1e-3, std::nan(""), HUGE_VAL, std::string("1"), true, std::int64_t{INT64_MAX}}};
    }
    Examples operator()(const Choices& c) const
    {
        Examples e{{}, {std::string(), std::string("no such choice"), std::int64_t{0}, true}};
        for (const std::string_view name : c.names) e.good.emplace_back(std::string(name));
        return e;
    }
};

TEST(Table, HasTheTechniquesOfThePublicHeader)
{
    std::set<std::string_view> kinds;
    std::set<std::size_t> structs;
    for (const TechniqueRow& row : technique_table()) {
        kinds.insert(row.kind);
        structs.insert(row.defaults.index());
    }
    EXPECT_EQ(kinds, (std::set<std::string_view>{"shadow_map", "soft_shadow_map", "soft_shadow_volume", "occlusion_texture", "smoothie",
                                                 "ray_traced", "depth_trace"}));
    EXPECT_EQ(structs.size(), std::variant_size_v<Technique>);
}

TEST(Table, EveryRowAndKeyIsDocumented)
{
    const std::set<std::string_view> lights{"rectangle", "sphere", "point", "directional"};
    for (const TechniqueRow& row : technique_table()) {
        EXPECT_FALSE(row.summary.empty() || row.source.empty() || row.inputs.empty()) << row.kind;
        EXPECT_FALSE(row.lights.empty()) << row.kind;
        for (const std::string_view light : row.lights) EXPECT_TRUE(lights.contains(light)) << row.kind << ", " << light;
        std::set<std::string_view> names;
        for (const SettingKey& key : row.keys) {
            EXPECT_TRUE(names.insert(key.name).second) << row.kind << "." << key.name << " twice";
            EXPECT_FALSE(key.meaning.empty()) << row.kind << "." << key.name;
            EXPECT_EQ(key.meaning.find('\n'), std::string_view::npos);
            // A real or whole number of something says of what, unless it is a mere label.
            const bool number = std::holds_alternative<IntegerRange>(key.domain) || std::holds_alternative<RealRange>(key.domain);
            EXPECT_TRUE(!number || !key.unit.empty() || key.name == "seed") << row.kind << "." << key.name;
        }
    }
}

TEST(Table, DefaultsLieInsideTheirDomains)
{
    for (const TechniqueRow& row : technique_table()) {
        TechniqueRequest request{.kind = std::string(row.kind), .settings = {}};
        for (const SettingKey& key : row.keys) request.settings.emplace_back(key.name, key.get(row.defaults));
        EXPECT_NO_THROW(technique_from(request)) << row.kind;
    }
}

TEST(Table, EveryKeyRoundTripsAndRefusesTheRest)
{
    for (const TechniqueRow& row : technique_table())
        for (const SettingKey& key : row.keys) {
            const Examples examples = std::visit(ExamplesOf{}, key.domain);
            const std::string name(key.name);
            for (const SettingValue& value : examples.good) {
                const Technique technique = technique_from({.kind = std::string(row.kind), .settings = {{name, value}}});
                EXPECT_EQ(kind_of(technique), row.kind);
                for (const auto& [back_name, back] : request_from(technique).settings)
                    EXPECT_EQ(back, back_name == name               ? value
                                    : row.keys[0].name == back_name ? row.keys[0].get(row.defaults)
                                                                    : back)
                        << row.kind << "." << name << ", " << back_name;
                EXPECT_EQ(key.get(technique), value) << row.kind << "." << name;
            }
            for (const SettingValue& value : examples.bad) {
                const Error error = error_of([&] { technique_from({.kind = std::string(row.kind), .settings = {{name, value}}}); });
                EXPECT_EQ(error.code(), ErrorCode::invalid_input);
                EXPECT_TRUE(holds(error.what(), "technique." + name + ": ")) << error.what();
                EXPECT_TRUE(holds(error.hint(), "expected ")) << error.what();
            }
        }
}

TEST(Table, RequestOfATechniqueNamesEveryKey)
{
    for (const TechniqueRow& row : technique_table()) {
        const TechniqueRequest request = request_from(row.defaults);
        EXPECT_EQ(request.kind, row.kind);
        EXPECT_EQ(request.settings.size(), row.keys.size());
    }
    const TechniqueRequest request = request_from(SoftShadowMap{.sides = Sides::back, .bias = 0.5});
    const auto find = [&](const std::string& key) {
        for (const auto& [name, value] : request.settings)
            if (name == key) return value;
        return SettingValue{};
    };
    EXPECT_EQ(find("sides"), SettingValue{std::string("back")});
    EXPECT_EQ(find("bias"), SettingValue{0.5});
    EXPECT_EQ(find("accumulator"), SettingValue{std::string("binary32")});
}

// A whole number stands for a real one, as JSON does not tell them apart.
TEST(Table, WholeNumbersServeAsReals)
{
    const Technique technique = technique_from({.kind = "soft_shadow_map", .settings = {{"bias", std::int64_t{2}}}});
    EXPECT_EQ(std::get<SoftShadowMap>(technique).bias, 2.0);
}

TEST(Table, UnknownNamesListTheKnown)
{
    const Error kind = error_of([] { technique_from({.kind = "soft_shadow_mpa", .settings = {}}); });
    EXPECT_EQ(kind.code(), ErrorCode::invalid_input);
    EXPECT_TRUE(holds(kind.what(), "technique.kind") && holds(kind.what(), "soft_shadow_mpa")) << kind.what();
    EXPECT_TRUE(holds(kind.hint(), "shadow_map, soft_shadow_map, soft_shadow_volume, occlusion_texture, smoothie, ray_traced"))
        << kind.what();
    // Not built yet is unknown, like a typo (docs/scene_file.md, technique).
    EXPECT_EQ(error_of([] { technique_from({.kind = "auto", .settings = {}}); }).code(), ErrorCode::invalid_input);

    const Error key = error_of([] { technique_from({.kind = "shadow_map", .settings = {{"sides", std::string("both")}}}); });
    EXPECT_EQ(key.code(), ErrorCode::invalid_input);
    EXPECT_TRUE(holds(key.what(), "technique.sides: unknown key of shadow_map")) << key.what();
    EXPECT_TRUE(holds(key.hint(), "filter, taps, bias")) << key.what();
}

TEST(Table, MessagesHoldTheNumbers)
{
    const Error range = error_of([] { technique_from({.kind = "shadow_map", .settings = {{"taps", std::int64_t{64}}}}); });
    EXPECT_TRUE(holds(range.what(), "64") && holds(range.hint(), "from 1 to 63")) << range.what();
    const Error choice = error_of([] { technique_from({.kind = "shadow_map", .settings = {{"filter", std::string("pcf")}}}); });
    EXPECT_TRUE(holds(choice.what(), "\"pcf\"") && holds(choice.hint(), "hard, percentage_closer, bicubic")) << choice.what();
}

TEST(Specialisations, EachOnceAndNamedByItsChoices)
{
    std::set<std::string> built;
    for (const auto& s : every_specialisation()) EXPECT_TRUE(built.insert(s.file + ' ' + s.options()).second) << s.options() << " twice";
    const std::string lanes16 = "-DLANES=16 -DITEM_ROWS=8 -DTILE_ROWS=8 ";
    EXPECT_TRUE(built.contains("soft_shadow_map.cl " + lanes16 + "-DACCUMULATOR=ACCUMULATOR_COMPENSATED"));
    EXPECT_TRUE(built.contains("soft_shadow_volume.cl " + lanes16 +
                               "-DLIGHT=LIGHT_RECTANGLE -DCOVERAGE=COVERAGE_TEXTURE -DCHANNELS=3 -DLOOKUP=LOOKUP_BILINEAR "
                               "-DACCUMULATOR=ACCUMULATOR_SIX_BITS"));
}

// Every choice that a program is built with is a name of common/choices.h.
TEST(Specialisations, ChoicesAreDefined)
{
    const std::string choices(opencl::kernel_file("common/choices.h"));
    for (const auto& s : every_specialisation())
        for (const auto& [name, value] : s.constants)
            if (value.starts_with(name)) {
                EXPECT_TRUE(holds(choices, "#define " + value + ' ')) << value;
            }
}

// PoCL's own header is longer than what the kernels call is declared in (common/builtins_pocl_31.clh). One of each file: the build's check
// compiles all of them with those declarations.
TEST(Specialisations, AreBuiltWithoutTheDriversHeader)
{
    const auto context = opencl::Context::open("");
    opencl::ProgramCache programs(context->context(), context->device(), "");
    std::set<std::string> files;
    double compile_ms = 0;
    for (const auto& s : every_specialisation())
        if (files.insert(s.file).second) programs.program(s, compile_ms);
    EXPECT_GT(files.size(), 8U);
    EXPECT_EQ(programs.built_with_header(), 0);
}

} // namespace
} // namespace penumbra::test
